"""Spot: connect, record, run, and a Spot that is not there. bosdyn is imported inside, where it is needed."""
