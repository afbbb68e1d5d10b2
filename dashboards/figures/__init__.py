"""Figures of runs for papers, one a file: `draw_x(ax, ...)`. Matplotlib, vector output, colours of the palette."""
