"""A run folder as the sections of a page read it."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from knittest.base.errors import InputError
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.config.yaml_loader import parse_document
from knittest.experiment.curves import ReferenceCurve
from knittest.laboratory.report_base import REPORTS, Report
from knittest.report_page.files import Columns, Comparison, Manifest, Reader, Summary

MAX_CONFIG = 1_000_000


@dataclass(frozen=True)
class LoadedRun:
    """All that a run folder holds; what could not be read is empty and named in ``problems``.

    ``config`` is config.yaml as written, ``run`` the same validated (``None`` for one of another schema).
    ``whole`` is False for the tables of a run that did not complete.
    """

    path: Path
    name: str
    manifest: Manifest
    summary: Summary
    comparison: Comparison
    config: dict[str, Any]
    config_text: str
    run: Run | None
    curve: Columns
    energies: Columns
    whole: bool
    problems: tuple[str, ...]
    number: int = 1

    @property
    def rig(self) -> str:
        """Kind of the test, empty if nothing tells."""
        return self.run.rig.kind if self.run else self.summary.rig or str(self.setting("rig", "kind") or "")

    @property
    def report(self) -> Report | None:
        """Report of its test; ``None`` for an unknown one."""
        return REPORTS.get(self.rig)

    @cached_property
    def reference(self) -> tuple[ReferenceCurve | None, str]:
        """The curve of the experiment that its test shows beside it, and why it is missing if it cannot be read."""
        if self.run is None or self.report is None:
            return None, ""
        try:
            return self.report.reference_curve(self.run), ""
        except InputError as error:
            return None, str(error)

    def setting(self, *path: str) -> Any:
        """Setting of config.yaml at ``path``, ``None`` if nothing."""
        found: Any = self.config
        for part in path:
            found = found.get(part) if isinstance(found, dict) else None
        return found

    @property
    def title(self) -> str:
        """Test, fabric, scale and direction."""
        fabric = self.setting("fabric", "name") or self.summary.variant
        scale = self.summary.scale or self.setting("model", "scale")
        direction = self.summary.direction or self.setting("rig", "direction")
        return ", ".join(str(part) for part in (self.rig, fabric, scale, direction) if part) or self.name


def load_run(path: Path, number: int = 1) -> LoadedRun:
    """Read the run folder ``path``; raises :class:`InputError` when nothing in it is knittest's."""
    reader = Reader(path)
    manifest = reader.model("manifest.json", Manifest)
    summary = Summary() if _swept(path, manifest) else reader.model("summary.json", Summary)
    comparison = Comparison() if _swept(path, manifest) else reader.model("comparison.json", Comparison)
    text, config, run = _config(reader)
    if not (manifest.status or summary.rig or "rig" in config):
        raise InputError(f"{path}: not a run folder of knittest: {'; '.join(reader.problems) or 'no status, no rig'}")
    curve, whole = _table(reader, "curve")
    energies, _ = _table(reader, "energies")
    return LoadedRun(
        path, _name(path), manifest, summary, comparison, config, text, run, curve, energies, whole,
        tuple(reader.problems), number,
    )  # fmt: skip


def _swept(path: Path, manifest: Manifest) -> bool:
    """Tell whether a run that did not complete lacks its results as it should."""
    return manifest.status not in ("", "completed") and not (path / "summary.json").exists()


def _name(path: Path) -> str:
    """Name of the folder, with that of the folder of both directions in front."""
    place = path.resolve()
    return f"{place.parent.name}/{place.name}" if place.name in ("warp", "weft") else place.name


def _config(reader: Reader) -> tuple[str, dict[str, Any], Run | None]:
    """Text, fields and validated run of config.yaml."""
    raw = reader.raw("config.yaml", MAX_CONFIG)
    if raw is None:
        return "", {}, None
    text = raw.decode("utf-8", errors="replace")
    try:
        fields = parse_document(text, "config.yaml").data
    except InputError as error:
        reader.complain(error)
        return text, {}, None
    try:
        return text, fields, resolve(config=reader.folder / "config.yaml", accept_limits=None)
    except InputError as error:
        reader.complain(f"not a config of this version, shown as written: {error}")
        return text, fields, None


def _table(reader: Reader, name: str) -> tuple[Columns, bool]:
    """A table of the run, or what one that did not complete left of it; False says that it is not whole."""
    part = f"{name}.incomplete.csv"
    if (reader.folder / part).exists() and not (reader.folder / f"{name}.csv").exists():
        return reader.table(part), False
    return reader.table(f"{name}.csv"), True
