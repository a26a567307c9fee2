"""A finger with effects: its readings as a function of all parameters, and fits of these to known touches."""
