"""Pure values that the views show: timelines, scenes, clocks, labels and planned paths."""
