"""The client side of a Spot: connection, clock, control, frames, tags and map upload."""
