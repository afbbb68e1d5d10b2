"""Tasks, goals, PDDL with `find`, solvers and strategies."""
