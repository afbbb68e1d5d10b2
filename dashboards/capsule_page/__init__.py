"""Markup, style sheet and scripts of the `lios capsule` page, which dashboards.capsule puts into one file."""
