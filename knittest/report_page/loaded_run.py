"""Loads a run folder for the sections of a report."""

import warnings
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from knittest.base.errors import InputError
from knittest.config.aliases import OldNameWarning
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.config.yaml_loader import parse_document
from knittest.experiment.curves import ReferenceCurve
from knittest.laboratory.report_base import REPORTS, Report
from knittest.report_page.files import Columns, Comparison, Manifest, Reader, Summary

MAX_CONFIG = 1_000_000


@dataclass(frozen=True)
class LoadedRun:
    """Contents of a run folder; unreadable parts are empty and named in ``problems``.

    ``config`` is config.yaml as written, ``run`` the validated config (``None`` for one of another version). ``whole``
    is False for the tables of an incomplete run.
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
        """Name of the test, empty if unknown."""
        return self.run.rig.kind if self.run else self.summary.rig or str(self.setting("rig", "kind") or "")

    @property
    def report(self) -> Report | None:
        """Report of its test; ``None`` for an unknown test."""
        return REPORTS.get(self.rig)

    @cached_property
    def reference(self) -> tuple[ReferenceCurve | None, str]:
        """Reference curve of the experiment, and the problem if it cannot be read."""
        if self.run is None or self.report is None:
            return None, ""
        try:
            return self.report.reference_curve(self.run), ""
        except InputError as error:
            return None, str(error)

    def setting(self, *path: str) -> Any:
        """Setting of config.yaml at ``path``, ``None`` without one."""
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
    """Read the run folder ``path``; raises :class:`InputError` for any other folder."""
    reader = Reader(path)
    manifest = reader.model("manifest.json", Manifest)
    # an incomplete run has neither
    missing = manifest.status not in ("", "completed") and not (path / "summary.json").exists()
    summary = Summary() if missing else reader.model("summary.json", Summary)
    comparison = Comparison() if missing else reader.model("comparison.json", Comparison)
    text, config, run = _config(reader)
    if not (manifest.status or summary.rig or "rig" in config):
        raise InputError(f"{path}: not a run folder of knittest: {'; '.join(reader.problems) or 'no status, no rig'}")
    curve, whole = _table(reader, "curve")
    energies, _ = _table(reader, "energies")
    place = path.resolve()
    name = f"{place.parent.name}/{place.name}" if place.name in ("warp", "weft") else place.name
    return LoadedRun(
        path, name, manifest, summary, comparison, config, text, run, curve, energies, whole,
        tuple(reader.problems), number,
    )  # fmt: skip


def _config(reader: Reader) -> tuple[str, dict[str, Any], Run | None]:
    raw = reader.raw("config.yaml", MAX_CONFIG)
    if raw is None:
        return "", {}, None
    text = raw.decode("utf-8", errors="replace")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OldNameWarning)  # an earlier version wrote them
        try:
            fields = parse_document(text, "config.yaml").data
        except InputError as error:
            reader.add_problem(error)
            return text, {}, None
        try:
            return text, fields, resolve(config=reader.folder / "config.yaml", accept_limits=None)
        except InputError as error:
            reader.add_problem(f"not a config of this version, shown as written: {error}")
            return text, fields, None


def _table(reader: Reader, name: str) -> tuple[Columns, bool]:
    """A table of the run, and False for the partial table of an incomplete run."""
    part = f"{name}.incomplete.csv"
    if (reader.folder / part).exists() and not (reader.folder / f"{name}.csv").exists():
        return reader.table(part), False
    return reader.table(f"{name}.csv"), True
