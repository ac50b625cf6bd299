"""``knittest cantilever``."""

from knittest.cli.testing import test_command

cantilever = test_command(
    "cantilever",
    """Let a strip bend over an edge under its own weight: chord angle, overhang, bending stiffness.

    Example: knittest cantilever --variant 1 --scale macro --direction warp --set rig.mode=overhang
    """,
)
