"""``knittest forming``."""

from knittest.cli.testing import test_command

forming = test_command(
    "forming",
    """Draw a blank into a die with a T, a hemisphere or STL files: shear angles, wrinkles, draw-in, yarn forces.

    Example: knittest forming --variant 1 --scale macro --blank-holder-force 100
    """,
    directional=False,
    shortcuts={"blank-holder-force": ("rig.blank_holder_force", "Force on the blank holder [N].  [default: 0, none]")},
)
