"""The Viser app, figures and the offline page."""
