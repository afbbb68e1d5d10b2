"""Commands of replayers: each parses its options, makes one call and prints the result."""
