"""Recording of runs and robots: the only package that writes MCAP."""
