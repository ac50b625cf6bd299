"""``knittest tensile``."""

from knittest.cli.testing import test_command

tensile = test_command(
    "tensile",
    """Pull a strip (200 x 50 mm, DIN EN ISO 13934-1) to failure and compare with the experiment.

    Example: knittest tensile --variant 2 --scale meso --preset paper --direction weft
    """,
)
