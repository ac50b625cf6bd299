"""Cantilever: a strip bends over an edge under its own weight."""
