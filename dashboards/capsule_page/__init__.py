"""The page of `lios capsule`: markup, sheet and scripts, put together into one file by dashboards.capsule."""
