"""Homogenisation: tests of yarns become a material card of the shells, which is held against them."""
