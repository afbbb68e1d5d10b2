"""Sight in passing: open furniture within the robot's sight radius, with no wall between."""
