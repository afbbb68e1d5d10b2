"""Occupancy grids, shortest paths on them, and cached travel costs."""
