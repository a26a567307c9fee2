"""E map of a finger identified from touches, with a prior centred on the elastic model."""
