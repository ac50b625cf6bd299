"""Bias extension: a strip cut at 45 deg to its yarns, pulled between two clamps."""
