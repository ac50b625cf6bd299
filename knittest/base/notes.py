"""Notes to the user on stderr beside errors, even when quiet: they concern the result."""

import sys
from contextlib import suppress


def tell(text: str) -> None:
    """Print ``text`` as a line of knittest; where nobody listens any more, nothing happens."""
    with suppress(OSError, ValueError, AttributeError):  # stderr full, closed, or not there at all
        print(f"knittest: {text}", file=sys.stderr, flush=True)
