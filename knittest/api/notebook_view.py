"""3D views of runs in a notebook."""

from collections.abc import Sequence
from html import escape
from pathlib import Path

from knittest.base.progress import is_in_notebook

STYLE = "width: 100%; height: 36em; border: 0"


class NotebookPages:
    """Pages in a notebook cell, which keeps them whole when the notebook is saved or sent without the run."""

    def __init__(self, pages: Sequence[Path]) -> None:
        self._pages = list(pages)

    def __repr__(self) -> str:
        return "\n".join(f"3D view: {page}" for page in self._pages)

    def _repr_html_(self) -> str:
        texts = (escape(page.read_text(encoding="utf-8")) for page in self._pages)
        return "\n".join(f'<iframe srcdoc="{text}" style="{STYLE}"></iframe>' for text in texts)


def show_views(folders: Sequence[Path]) -> NotebookPages | None:
    """Write the 3D views of run ``folders`` for a notebook, else open the browser; raises :class:`InputError`."""
    from knittest.report_page.moving.page import write_view

    pages = [write_view(folder) for folder in folders]
    if is_in_notebook():
        return NotebookPages(pages)
    import webbrowser

    for page in pages:
        webbrowser.open(page.resolve().as_uri())
    return None
