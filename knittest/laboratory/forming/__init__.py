"""Forming: a blank between stamp, die and blank holder."""
