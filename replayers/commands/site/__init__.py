"""Commands under `lios site` that read logs and maps of GraphNav."""
