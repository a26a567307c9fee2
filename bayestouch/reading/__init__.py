"""Reading touches, whatever the body: options, blocks of touches, the check of the sensor."""
