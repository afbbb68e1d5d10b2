"""Drafts of site surveys from logs."""
