"""When a strategy decides alike: by what it reads of the state."""
