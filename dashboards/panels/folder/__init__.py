"""Panels of a folder of runs: the table, its cells and pairs, and which strategy to drive next."""
