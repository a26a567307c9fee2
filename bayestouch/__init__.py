"""How far a tactile sensor's readings can be trusted."""

__version__ = "0.1.0"
