"""Parts of a tree of runs (run_tree.py): its options, and segments without events."""
