"""Figures of evaluations, one per file, as functions draw_x(ax, ...) -> None."""
