"""A Spot session recorded: sensor pollers, topics, and the actions inferred from them."""
