"""The MCAP writer: files, chunks, channels and the index at the end."""
