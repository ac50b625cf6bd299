"""A study of a test's model that its pages show beside a run."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Study:
    """Table of a study under its ``caption``: ``rows`` are a label and numbers, NaN where there is none, that ``form``
    shows; ``note`` says where they come from.
    """

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, tuple[float, ...]], ...]
    note: str
    form: str = "{:.2f}"
