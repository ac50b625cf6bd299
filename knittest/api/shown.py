"""Moving views as a notebook shows them."""

from collections.abc import Sequence
from html import escape
from pathlib import Path

from knittest.base.progress import in_notebook

STYLE = "width: 100%; height: 36em; border: 0"


class Shown:
    """Pages that a notebook's cell holds whole: they stay in it when the notebook is saved or sent without the run."""

    def __init__(self, pages: Sequence[Path]) -> None:
        self._pages = list(pages)

    def __repr__(self) -> str:
        return "\n".join(f"moving view: {page}" for page in self._pages)

    def _repr_html_(self) -> str:
        return "\n".join(
            f'<iframe srcdoc="{escape(page.read_text(encoding="utf-8"))}" style="{STYLE}"></iframe>'
            for page in self._pages
        )


def show_views(folders: Sequence[Path]) -> Shown | None:
    """Write the moving views of the run ``folders``: an object for a notebook to display, or opened in the browser.

    Raises :class:`InputError` where a run was made without frames.
    """
    from knittest.report_page.moving.page import view

    pages = [view(folder) for folder in folders]
    if in_notebook():
        return Shown(pages)
    import webbrowser

    for page in pages:
        webbrowser.open(page.resolve().as_uri())
    return None
