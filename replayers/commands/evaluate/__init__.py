"""`lios evaluate replay`, `select` and `spot`: each parses its options, makes one call and prints the result."""
