"""All that is particular to a pad: its fit, its model with effects, its reader."""
