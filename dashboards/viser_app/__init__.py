"""The only code that talks to Viser, through its public API."""
