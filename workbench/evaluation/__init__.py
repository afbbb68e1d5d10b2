"""Trials, tables and statistics; running many, here or on a cluster."""
