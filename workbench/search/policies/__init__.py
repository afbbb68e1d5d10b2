"""Search policies, and the table that finds them by name."""
