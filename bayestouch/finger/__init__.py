"""Everything that is specific to fingers: fit, model with effects, reading of touches."""
