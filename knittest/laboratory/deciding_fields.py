"""Fields of a fabric that decide the results of more than one test of yarns."""

LOOPS = ("loop_length", "knitting.beam_diameter", "knitting.bending_stiffness", "knitting.degree_of_set")
PULLED = (
    "reinforcing.youngs_modulus", "reinforcing.load_area", "reinforcing.fracture_strain", "reinforcing.crimp.{d}",
    "reinforcing.slack.{d}",
)  # fmt: skip
