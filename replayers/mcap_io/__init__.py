"""The MCAP reader: records, summaries, scans, and what a damaged file still gives."""
