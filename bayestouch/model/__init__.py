"""The model of a sensor with effects, for every body: predictions, derivatives, noise, fits."""
