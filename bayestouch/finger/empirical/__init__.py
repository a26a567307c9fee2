"""A finger's empirical E map: response measured place by place, without an elastic model."""
