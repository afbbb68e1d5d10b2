"""A log as a run: its events, its state at any time, its sensor data."""
