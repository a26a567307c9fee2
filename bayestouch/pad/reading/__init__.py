"""Reading touches on a pad."""
