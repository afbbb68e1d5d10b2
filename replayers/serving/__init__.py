"""Logs played to viewers such as Foxglove, Lichtblick and PlotJuggler."""
