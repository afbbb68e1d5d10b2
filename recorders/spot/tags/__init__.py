"""Tags of items: detected by the robot or in its pictures, placed on the map and in containers."""
