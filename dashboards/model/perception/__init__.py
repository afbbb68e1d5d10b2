"""What the robot of a run sees from where it is, what it saw in passing, and what its looks may have missed."""
