"""Spot support: connecting, recording, running tasks, and a simulated robot. bosdyn is imported lazily."""
