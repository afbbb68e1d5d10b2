"""The memory of a place from its logs."""
