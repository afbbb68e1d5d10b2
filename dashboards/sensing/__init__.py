"""Sensor data at a moment: pictures, point clouds and local grids, placed on the map."""
