"""Inference of touches on a pad."""
