"""``knittest friction``."""

from knittest.cli.testing import test_command

friction = test_command(
    "friction",
    """Pull a strip out between two plates pressed together: pull force, friction coefficient.

    Example: knittest friction --variant 1 --scale macro --direction warp
    """,
)
