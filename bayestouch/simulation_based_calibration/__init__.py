"""Validation of posteriors by simulation-based calibration and ranks."""
