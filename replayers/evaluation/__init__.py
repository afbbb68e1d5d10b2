"""Experiments on replay itself: coverage, calibration, and the Spot experiment."""
