"""What is believed beforehand: parameters with their priors, of the sensor and of the indenters."""
