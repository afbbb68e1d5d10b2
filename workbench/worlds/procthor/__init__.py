"""ProcTHOR houses: the JSON schema, the loader and Unity's frame."""
