"""The measuring chain: readings of each element from pose and load of a touch, through contact and body."""
