"""Panels of a run that is being recorded."""
