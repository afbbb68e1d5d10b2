"""Logs as data frames, and their export."""
