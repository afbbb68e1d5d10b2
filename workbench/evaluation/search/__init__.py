"""The object-search experiment."""
