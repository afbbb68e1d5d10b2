"""Where the robot is: floor plans, houses, travel costs, and the worlds that answer its actions."""
