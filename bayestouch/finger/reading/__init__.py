"""Inference of touches on a finger."""
