"""Checks of a log: the container's, the events' and the run's."""
