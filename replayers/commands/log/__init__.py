"""The `lios log` commands, named as in the mcap CLI."""
