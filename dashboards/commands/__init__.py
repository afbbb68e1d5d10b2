"""Commands of dashboards: each parses its options, makes one call and prints the result."""
