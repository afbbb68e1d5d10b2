"""What stands still, with the light on it worked out once, for viewers that then draw it without lamps."""
