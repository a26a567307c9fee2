"""A sensor with effects, of any body: predictions, derivatives, noise, fits."""
