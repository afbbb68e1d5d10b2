"""Oblivious boosted trees as arrays, and their compiled loops."""
