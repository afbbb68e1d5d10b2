"""People's votes for where things belong, an estimator based on them, and its mixture with a learned one."""
