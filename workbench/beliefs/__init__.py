"""Estimators: beliefs about where items are, and their training. The only package that imports torch."""
