"""What the logs of a place remember of it."""
