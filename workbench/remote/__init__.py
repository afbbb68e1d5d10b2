"""Files at fsspec addresses, such as s3://bucket/run.mcap: paths, reading by ranges, errors, uploads."""
