"""Where people say that things belong: votes, an estimator that goes by them, and its mixture with a learned one."""
