"""Estimators whose answers cost something: a language model, a service, a slow computation."""
