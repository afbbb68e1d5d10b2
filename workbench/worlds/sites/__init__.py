"""Surveyed real places: survey files, ROS maps, checks and configurations."""
