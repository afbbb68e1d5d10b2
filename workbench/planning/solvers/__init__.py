"""Solvers of typed planning problems: the direct SAS+ route, PDDL planners, closed forms."""
