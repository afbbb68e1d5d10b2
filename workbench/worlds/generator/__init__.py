"""Generated houses, drawn from the statistics of real ones."""
