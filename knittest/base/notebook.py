"""Cells of a notebook: whether one runs this code, and a text in its output that is renewed in place."""

import sys
from typing import Any


def in_notebook() -> bool:
    """Tell whether a notebook's kernel runs this code."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    return shell is not None and "IPKernelApp" in shell.config


class CellText:
    """A text in the output of the cell that first shows it."""

    def __init__(self) -> None:
        self._handle: Any = None

    def show(self, text: str) -> None:
        """Show ``text`` in place of the one before."""
        from IPython.display import display

        if self._handle is None:
            self._handle = display({"text/plain": text}, raw=True, display_id=True)
        else:
            self._handle.update({"text/plain": text}, raw=True)
