"""Sinks of recorded messages: files, split files, a ring buffer, a writing thread."""
