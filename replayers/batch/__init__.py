"""Many logs: replaying all strategies over them, storing the results and comparing them."""
