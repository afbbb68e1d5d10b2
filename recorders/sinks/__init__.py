"""Where recorded messages go: files, split files, a ring buffer, a writing thread."""
