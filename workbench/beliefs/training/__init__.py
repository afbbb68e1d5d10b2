"""Training of the estimators."""
