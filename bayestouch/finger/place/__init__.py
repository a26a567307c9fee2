"""A finger's discrepancy as a function of place: a Gaussian process, in calibration and inference."""
