"""Are the posteriors what they claim to be? Simulation-based calibration and ranks."""
