"""Calibration: parameters of a fabric or a rig found from what tests must come to, by trials."""
