"""The runs that can be opened: logs, folders of logs, and the table of runs."""
