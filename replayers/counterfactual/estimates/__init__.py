"""Mean costs and intervals over worlds drawn from the belief."""
