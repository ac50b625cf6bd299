"""knittest: virtual material tests of biaxial weft-knitted fabrics."""

__version__ = "0.1.0"
