"""Cell test: one periodic cell of yarns under a given mean deformation."""
