"""The chain of a touch: from pose and load through contact and body to the readings of each element."""
