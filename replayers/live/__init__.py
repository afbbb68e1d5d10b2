"""Replays beside a run that is being recorded."""
