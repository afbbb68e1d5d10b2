"""Trials, tables and statistics of evaluations, run on one machine or on a cluster."""
