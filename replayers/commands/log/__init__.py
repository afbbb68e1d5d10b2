"""Parts of the `lios log` commands: their shared options, `cat` and `note`."""
