"""Studies as functions: sweeps, calibrations, cards of the shells and bands, with a folder as the result."""

import json
import warnings
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from knittest.api.fabric import Fabric, FabricLike, Sets, settings_of
from knittest.base.errors import InputError, RefusedWarning
from knittest.base.kinds import DEFAULT
from knittest.config.settings import Setting
from knittest.studies.trials.runner import Studied

if TYPE_CHECKING:
    from pandas import DataFrame

    from knittest.studies.homogenise.plan import Source

Place = PathLike[str] | str
#: files of a study's folder: its own summary, and what it makes
SUMMARIES = ("calibration.json", "homogenise.json", "uncertainty.json")
TABLE, FABRIC, PAGE = "results.csv", "fabric.yaml", "report.html"


class Study:
    """A study's ``folder``, and whether it ``passed``: its command ended with 0.

    Files are read when they are asked for; units are in the names of columns and results.
    """

    def __init__(self, folder: Place, passed: bool = True) -> None:
        self.folder, self.passed = Path(folder), passed

    def __repr__(self) -> str:
        return f"<Study {self.folder}: {'passed' if self.passed else 'not passed'}>"

    @property
    def results(self) -> "DataFrame":
        """Table of a sweep, one row a run, or of bands, one row a point. Raises :class:`InputError` where none is."""
        import pandas as pd

        return pd.read_csv(self._file(TABLE, "only sweeps and bands have a table"))

    @property
    def summary(self) -> Mapping[str, Any]:
        """Summary of a calibration, a card or bands, as its JSON file holds it; empty for a sweep."""
        found = [self.folder / name for name in SUMMARIES if (self.folder / name).is_file()]
        return dict(json.loads(found[0].read_text(encoding="utf-8"))) if found else {}

    @property
    def fabric(self) -> Fabric:
        """Fabric that a calibration or a card made. Raises :class:`InputError` where none was."""
        return Fabric.load(self._file(FABRIC, "a calibration that converged and a card have one"))

    @property
    def page(self) -> Path:
        """Page on the study, ``report.html``. Raises :class:`InputError` where none was written."""
        return self._file(PAGE, "a card has none")

    def _file(self, name: str, why: str) -> Path:
        if not (path := self.folder / name).is_file():
            raise InputError(f"{self.folder}: has no {name}: {why}")
        return path


def batch(
    sweep: Place, *, out: Place | None = None, workers: int | None = None, threads: int | None = None,
    parquet: bool = False, quiet: bool = False, accept_limits: bool = False,
) -> Study:  # fmt: skip
    """Run the sweep in the file ``sweep``, or what is left of it, whatever the number of its runs.

    Warns with :class:`RefusedWarning` where a run has no good result; raises :class:`InputError` before anything runs.
    """
    from knittest.studies.batch.command import BatchOptions, run_batch

    options = BatchOptions(
        out=_path(out), workers=workers, threads=threads, parquet=parquet, quiet=quiet, accept_limits=accept_limits
    )
    return _study(run_batch(Path(sweep), options, lambda question: True), "not every run has a good result")


def calibrate(
    calibration: Place, *, out: Place | None = None, workers: int | None = None, threads: int | None = None,
    storage: str | None = None, quiet: bool = False, accept_limits: bool = False,
) -> Study:  # fmt: skip
    """Find parameters as the file ``calibration`` says, or go on with it; its ``fabric`` has them.

    Warns with :class:`RefusedWarning` where it did not converge; raises :class:`InputError` before anything runs.
    """
    from knittest.studies.calibrate.command import CalibrateOptions, run_calibration

    options = CalibrateOptions(_path(out), workers, threads, quiet, storage, accept_limits)
    return _study(run_calibration(Path(calibration), options), "the calibration did not converge")


def uncertainty(
    study: Place, *, out: Place | None = None, workers: int | None = None, quiet: bool = False,
    accept_limits: bool = False,
) -> Study:  # fmt: skip
    """Run the study of bands in the file ``study``, or what is left of it.

    Warns with :class:`RefusedWarning` where runs have no result; raises :class:`InputError` before anything runs.
    """
    from knittest.studies.uncertainty.command import UncertaintyOptions, run_uncertainty

    options = UncertaintyOptions(_path(out), workers, quiet, accept_limits)
    return _study(run_uncertainty(Path(study), options), "runs have no result: see its page")


def homogenise(
    fabric: FabricLike, *, source: "Source" = "tests", preset: str | None = "quick",
    parameters: str | None = None, set: Sets = (), out: Place | None = None, workers: int | None = None,
    quiet: bool = False,
) -> Study:  # fmt: skip
    """Make a material card of the shells from tests of yarns, or paths of one ``cell``; its ``fabric`` is the card.

    ``set`` has fields of all tests of yarns by path, in their own units. Warns with :class:`RefusedWarning` where there
    is no card, or shells with it do not reproduce the yarns; raises :class:`InputError` before anything runs.
    """
    from knittest.studies.homogenise.command import HomogeniseOptions, run_homogenisation
    from knittest.studies.homogenise.plan import Request

    chosen = Fabric.load(fabric)
    sets = tuple(_text(one) for one in (*chosen.settings, *settings_of(set, DEFAULT)))
    request = Request(chosen.variant, chosen.file, parameters, preset, None, sets, source=source)
    command = f"knittest.homogenise({chosen.variant or str(chosen.file)!r}, source={source!r}, set={list(sets)})"
    found = run_homogenisation(request, HomogeniseOptions(_path(out), workers, quiet=quiet), command)
    return _study(found, "no card, or one that does not reproduce the yarns: see homogenise.json")


def _study(found: Studied, otherwise: str) -> Study:
    if found.exit_code:
        warnings.warn(f"{found.folder}: {otherwise}", RefusedWarning, stacklevel=3)
    return Study(found.folder, found.exit_code == 0)


def _path(place: Place | None) -> Path | None:
    return None if place is None else Path(place)


def _text(setting: Setting | str) -> str:
    """A setting as an option of the command gives it; JSON is YAML."""
    return setting if isinstance(setting, str) else f"{'.'.join(map(str, setting.path))}={json.dumps(setting.value)}"
