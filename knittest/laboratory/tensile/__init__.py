"""Tensile test: a strip between two clamps."""
