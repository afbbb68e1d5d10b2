"""The Viser dashboard, figures and the offline page."""
