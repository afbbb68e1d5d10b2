"""Geometry of a house and of marks over it: floors, walls, furniture. Pure functions, independent of any viewer."""
