"""Everything that is specific to pads: fit, model with effects, reading of touches."""
