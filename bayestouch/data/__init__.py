"""The data: sensor, touch tables, data sets, and the steps that prepare readings for a model."""
