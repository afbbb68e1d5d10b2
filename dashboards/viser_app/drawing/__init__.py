"""What one browser sees in the view: the house, beliefs, robots and sensors."""
