"""The view of one browser: the house, beliefs, robots and sensors."""
