"""Friction: a strip is pulled out between two plates."""
