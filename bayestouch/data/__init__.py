"""The data: sensor, touch tables, data sets, and what is done to readings before any model sees them."""
