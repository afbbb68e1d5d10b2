"""Tools on log files: info, list, filter, merge, split, recover, convert and notes."""
