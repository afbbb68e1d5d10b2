"""Paths of the robot: walked, measured by odometry, and planned."""
