"""Reading touches on a finger."""
