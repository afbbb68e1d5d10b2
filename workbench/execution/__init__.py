"""The closed execution loop (look, believe, plan, act), which yields events."""
