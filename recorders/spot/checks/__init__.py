"""Checks of a robot, its map and this computer before anything moves."""
