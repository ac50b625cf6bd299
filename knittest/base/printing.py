"""Printing of pictures: beside PNG the formats that were asked for, and how fine their pixels are."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

from knittest.base.errors import InputError

#: pixels an inch where none are asked for, and the bounds of what may be
DPI, LEAST, MOST = 150, 50, 1200
#: formats of pictures; PNG is written always, for pages show it
FORMATS = ("png", "svg", "pdf")


@dataclass(frozen=True)
class Printing:
    """Vector ``formats`` beside PNG, and pixels an inch of PNG and of the fields within vector pictures."""

    formats: tuple[str, ...] = ()
    dpi: int = DPI

    @property
    def pixels(self) -> float:
        """Pixels over those of a picture that nothing was asked of."""
        return (self.dpi / DPI) ** 2


_PRESENT: ContextVar[Printing] = ContextVar("printing", default=Printing())  # noqa: B039 - it does not change


@contextmanager
def printed(printing: Printing) -> Iterator[None]:
    """All pictures that are written inside are written as ``printing`` says."""
    token = _PRESENT.set(printing)
    try:
        yield
    finally:
        _PRESENT.reset(token)


def present() -> Printing:
    """Printing that is asked for now."""
    return _PRESENT.get()


def printing_of(formats: str | None, dpi: int | None) -> Printing:
    """Read ``formats``, such as "svg,pdf", and ``dpi``; raises :class:`InputError` for others."""
    asked = [one.strip().lower() for one in (formats or "").split(",") if one.strip()]
    if unknown := [one for one in asked if one not in FORMATS]:
        known = ",".join(FORMATS)
        raise InputError(f"--format {formats}: {unknown[0]} is no format of pictures; expected some of {known}")
    if dpi is not None and not LEAST <= dpi <= MOST:
        raise InputError(f"--dpi {dpi}: expected {LEAST} to {MOST} pixels an inch")
    return Printing(tuple(dict.fromkeys(one for one in asked if one != "png")), DPI if dpi is None else dpi)
