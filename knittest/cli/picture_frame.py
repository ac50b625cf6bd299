"""``knittest picture-frame``."""

from knittest.cli.testing import test_command

picture_frame = test_command(
    "picture-frame",
    """Shear a square of fabric in a hinged frame: force, shear angle, wrinkles.

    Example: knittest picture-frame --variant 1 --scale macro
    """,
    directional=False,
)
