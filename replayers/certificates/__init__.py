"""Certificates of a strategy's cost over one log, for readers who do not trust this program."""
