"""Batches: from a sweep to trials, their table and their picture."""
