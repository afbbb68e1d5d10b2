"""Figures of runs for papers, one in each module: `draw_x(ax, ...)`, by matplotlib, in the colours of the palette."""
