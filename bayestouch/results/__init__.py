"""Results of the main functions (calibrations, posteriors of touches), and their files."""
