"""Inference of touches for every body: options, blocks of touches, check of the sensor, draws."""
