"""Checks before a run: sizes, counterparts of its numbers, and the time it will take."""
