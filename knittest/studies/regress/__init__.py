"""Regression: the code against Table 3, its cost against Table 4, and its numbers against a stored baseline."""
