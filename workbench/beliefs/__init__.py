"""What the robot believes about where things are. The only room that imports torch."""
