"""Markup, style sheet and scripts of the `lios capsule` page, which dashboards.capsule.write puts into one file."""
