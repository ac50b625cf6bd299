"""Checks before a run: model sizes, independent values of the fabric's numbers, and the run time."""
