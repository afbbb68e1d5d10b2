"""When a strategy decides alike: by what it reads of the state, and whatever else open containers hold."""
