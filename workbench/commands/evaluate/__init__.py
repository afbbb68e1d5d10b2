"""`lios evaluate belief` and `solvers`: each parses its arguments, makes one call and prints the result."""
