"""Runs as recordings that Rerun's viewer draws; the only code that talks to Rerun's SDK."""
