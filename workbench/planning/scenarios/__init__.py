"""Tasks: the paper's scenarios, scenario files, and whether a house supports them."""
