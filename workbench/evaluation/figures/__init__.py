"""Figures of evaluations, one drawing a file: draw_x(ax, ...) -> None."""
