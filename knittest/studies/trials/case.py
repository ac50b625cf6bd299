"""A test of a fabric as the file of a study gives it, on which the study lays its own settings run by run."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from knittest.base.errors import InputError
from knittest.config.chosen import Chosen
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.config.settings import Setting
from knittest.config.sources import variant_path
from knittest.config.yaml_loader import Document, KeyPath

#: fields of a block of a study's file, and where in a run they belong
FIELDS: dict[str, KeyPath] = {
    "parameters": ("parameters",),
    "scale": ("model", "scale"),
    "preset": ("model", "preset"),
    "direction": ("rig", "direction"),
}


@dataclass(frozen=True)
class Case:
    """One test of the fabric file ``fabric``."""

    name: str
    kind: str
    fabric: Path
    config: Path | None
    settings: tuple[Setting, ...]
    accept_limits: bool = False

    def run(self, settings: Sequence[Setting] = ()) -> Run:
        """The run with ``settings``; raises :class:`InputError` where the schema refuses them."""
        return resolve(
            test=self.kind, fabric=self.fabric, config=self.config, sets=[*self.settings, *settings],
            accept_limits=self.accept_limits,
        )  # fmt: skip


def fabric_path(chosen: Chosen, document: Document, at: KeyPath) -> Path:
    """The fabric file that the block ``at`` of ``document`` names; raises :class:`InputError` unless it is there."""
    where, said = document.where(at), ".".join(map(str, at))
    if (chosen.variant is None) == (chosen.fabric is None):
        raise InputError(f"{where}: {said}: expected variant (a shipped fabric) or fabric (a file), one of them")
    if chosen.fabric is not None:
        return existing(Path(document.source).resolve().parent / chosen.fabric, document.where((*at, "fabric")))
    try:
        return variant_path(str(chosen.variant))
    except InputError as error:
        raise InputError(f"{document.where((*at, 'variant'))}: {error}") from None


def existing(path: Path, where: str) -> Path:
    """``path``, if it is a file; raises :class:`InputError`."""
    if not path.is_file():
        raise InputError(f"{where}: no such file: {path}")
    return path


def settings_of(given: BaseModel, document: Document, at: KeyPath) -> list[Setting]:
    """Settings that the block ``given``, ``at`` in ``document``, makes: of :data:`FIELDS` and of its ``set``."""
    found = [
        Setting(path, value, document.where((*at, name)))
        for name, path in FIELDS.items()
        if (value := getattr(given, name, None)) is not None
    ]
    values: dict[str, Any] = getattr(given, "set", {})
    for name, value in values.items():
        where, path = document.where((*at, "set", name)), tuple(name.split("."))
        if not all(path):
            raise InputError(f"{where}: {name!r}: expected the dotted path of a field, for example rig.width")
        found.append(Setting(path, value, where))
    return found
