"""Diagnose: find what the model misses, trace it to an effect, add the effect, and report before and after."""
