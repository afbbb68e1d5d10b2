"""Commands on houses, training, sites and names, and `lios new`: each parses its arguments and makes one call."""
