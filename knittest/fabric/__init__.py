"""Geometry of the biaxial weft-knit: loop, relaxed periodic cell, topology, strips of yarn paths, scatter."""
