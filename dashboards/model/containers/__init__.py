"""Containers and what was seen in them: appearance, history, items."""
