"""Faces in the pictures of a log: found, and blurred in a copy."""
