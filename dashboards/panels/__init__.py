"""Panels beside the 3D view, as HTML and SVG: pure functions, shared by the Viser app and the offline page.

Names come from logs, so every text is escaped by `text`; markup in a name is shown and never run.
"""
