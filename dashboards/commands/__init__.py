"""Commands of this room: each parses, makes one call, prints."""
