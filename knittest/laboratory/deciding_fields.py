"""Fields of a fabric that decide the results of more than one test of yarns."""

LOOPS = ("loop_length", "knitting.beam_diameter", "knitting.bending_stiffness", "knitting.degree_of_set")
PULLED = (
    "reinforcing.youngs_modulus", "reinforcing.load_area", "reinforcing.fracture_strain", "reinforcing.crimp.{d}",
    "reinforcing.slack.{d}",
)  # fmt: skip
#: patches count where a fabric states them
CROSSINGS = (
    "contact.friction_coefficient", "contact.patch.radius.inlay_inlay", "contact.patch.radius.inlay_loop",
    "contact.patch.radius.loop_loop", "contact.patch.compaction.reinforcing", "contact.patch.compaction.knitting",
)  # fmt: skip
