"""Compaction: a piece of fabric is pressed between two plates."""
