"""Environments: floor plans, houses, travel costs, and the worlds that execute actions."""
