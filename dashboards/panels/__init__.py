"""What stands beside the 3D view, as HTML and SVG: pure functions, shared by the Viser app and the offline page.

Names come from logs, so every text passes through `text`; markup in a name is shown and never run.
"""
