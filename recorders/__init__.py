"""The only code that writes MCAP."""
