"""Parameters and their priors: of the sensor and of the indenters."""
