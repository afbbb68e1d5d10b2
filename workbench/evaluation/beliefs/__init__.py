"""Evaluation of belief estimators."""
