"""Biaxial test: a square of fabric pulled along warp and weft at once."""
