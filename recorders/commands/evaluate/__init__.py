"""`lios evaluate search` and `tasks`, with their tables for remembered objects."""
