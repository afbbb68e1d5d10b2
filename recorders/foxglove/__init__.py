"""A run's viewer channels, as Foxglove's schemas."""
