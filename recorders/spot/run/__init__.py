"""A task run on a Spot: navigation, manipulation, the operator, and what stops it."""
