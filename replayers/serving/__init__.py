"""Logs played to viewers such as Foxglove and Lichtblick."""
