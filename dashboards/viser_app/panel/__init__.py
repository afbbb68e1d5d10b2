"""The panel of one browser: its controls and tabs."""
