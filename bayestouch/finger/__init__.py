"""All that is particular to a finger: its fit, its model with effects, its reader."""
