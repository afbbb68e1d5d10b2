"""`lios spot resume`, which reads the log of a run that ended early."""
