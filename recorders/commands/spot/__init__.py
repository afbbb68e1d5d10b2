"""The `lios spot` commands that call a robot."""
