"""What the views show, as pure values: timelines, scenes, clocks, labels and planned paths."""
