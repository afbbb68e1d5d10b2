"""What a robot sees in passing: open furniture within its sight radius, with no wall between."""
