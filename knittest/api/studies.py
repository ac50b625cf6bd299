"""Studies as functions: sweeps, calibrations, macro material cards and uncertainty, with a folder as the result."""

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
from knittest.studies.trials.runner import StudyOptions, StudyResult

if TYPE_CHECKING:
    from pandas import DataFrame

    from knittest.studies.homogenise.plan import Source

Place = PathLike[str] | str
#: files of a study's folder
SUMMARIES = ("calibration.json", "homogenise.json", "uncertainty.json")
TABLE, FABRIC, PAGE = "results.csv", "fabric.yaml", "report.html"


class Study:
    """Folder of a study, and whether it ``passed`` (exit code 0 of its command).

    Files are read on access; units are in the names of columns and results.
    """

    def __init__(self, folder: Place, passed: bool = True) -> None:
        self.folder, self.passed = Path(folder), passed

    def __repr__(self) -> str:
        return f"<Study {self.folder}: {'passed' if self.passed else 'not passed'}>"

    @property
    def results(self) -> "DataFrame":
        """Table of a sweep, a row a run, or of uncertainty, a row a point. Raises :class:`InputError` without one."""
        import pandas as pd

        return pd.read_csv(self._file(TABLE, "only sweeps and studies of uncertainty have a table"))

    @property
    def summary(self) -> Mapping[str, Any]:
        """Summary of a calibration, a card or uncertainty from its JSON file; empty for a sweep."""
        found = [self.folder / name for name in SUMMARIES if (self.folder / name).is_file()]
        return dict(json.loads(found[0].read_text(encoding="utf-8"))) if found else {}

    @property
    def fabric(self) -> Fabric:
        """Fabric of a calibration or a card. Raises :class:`InputError` without one."""
        return Fabric.load(self._file(FABRIC, "only a converged calibration and a card have one"))

    @property
    def page(self) -> Path:
        """Page of the study, ``report.html``. Raises :class:`InputError` without one."""
        return self._file(PAGE, "a card has no page")

    def _file(self, name: str, why: str) -> Path:
        if not (path := self.folder / name).is_file():
            raise InputError(f"{self.folder}: has no {name}: {why}")
        return path


def batch(
    sweep: Place, *, out: Place | None = None, workers: int | None = None, threads: int | None = None,
    parquet: bool = False, quiet: bool = False, accept_limits: bool = False,
) -> Study:  # fmt: skip
    """Run or resume the sweep in the file ``sweep``, with any number of runs.

    Warns with :class:`RefusedWarning` if a run has no valid result; raises :class:`InputError` before anything runs.
    """
    from knittest.studies.batch.command import BatchOptions, run_batch

    options = BatchOptions(
        out=_path(out), workers=workers, threads=threads, parquet=parquet, quiet=quiet, accept_limits=accept_limits
    )
    return _make_study(run_batch(Path(sweep), options, lambda question: True), "not every run has a valid result")


def calibrate(
    calibration: Place, *, out: Place | None = None, workers: int | None = None, threads: int | None = None,
    storage: str | None = None, quiet: bool = False, accept_limits: bool = False,
) -> Study:  # fmt: skip
    """Run or resume the calibration in the file ``calibration``; its ``fabric`` has the parameters found.

    Warns with :class:`RefusedWarning` if it did not converge; raises :class:`InputError` before anything runs.
    """
    from knittest.studies.calibrate.command import CalibrateOptions, run_calibration

    options = CalibrateOptions(
        out=_path(out), workers=workers, threads=threads, storage=storage, quiet=quiet, accept_limits=accept_limits
    )
    return _make_study(run_calibration(Path(calibration), options), "the calibration did not converge")


def uncertainty(
    study: Place, *, out: Place | None = None, workers: int | None = None, quiet: bool = False,
    accept_limits: bool = False,
) -> Study:  # fmt: skip
    """Run or resume the study of uncertainty in the file ``study``.

    Warns with :class:`RefusedWarning` if runs lack a result; raises :class:`InputError` before anything runs.
    """
    from knittest.studies.uncertainty.command import run_uncertainty

    options = StudyOptions(out=_path(out), workers=workers, quiet=quiet, accept_limits=accept_limits)
    return _make_study(run_uncertainty(Path(study), options), "some runs lack a result: see its page")


def homogenise(
    fabric: FabricLike, *, source: "Source" = "tests", preset: str | None = "quick",
    parameters: str | None = None, set: Sets = (), out: Place | None = None, workers: int | None = None,
    quiet: bool = False,
) -> Study:  # fmt: skip
    """Derive the macro material card from meso tests, or from paths of one ``cell``; its ``fabric`` is the card.

    ``set`` has fields of all meso tests by path, in their own units. Warns with :class:`RefusedWarning` if there is no
    card, or the macro model does not reproduce the meso model; raises :class:`InputError` before anything runs.
    """
    from knittest.studies.homogenise.command import HomogeniseOptions, run_homogenisation
    from knittest.studies.homogenise.plan import Request

    chosen = Fabric.load(fabric)
    sets = tuple(_setting_text(one) for one in (*chosen.settings, *settings_of(set, DEFAULT)))
    request = Request(chosen.variant, chosen.file, parameters, preset, None, sets, source=source)
    command = f"knittest.homogenise({chosen.variant or str(chosen.file)!r}, source={source!r}, set={list(sets)})"
    found = run_homogenisation(request, HomogeniseOptions(out=_path(out), workers=workers, quiet=quiet), command)
    return _make_study(found, "no card, or a card that does not reproduce the meso model: see homogenise.json")


def _make_study(found: StudyResult, otherwise: str) -> Study:
    if found.exit_code:
        warnings.warn(f"{found.folder}: {otherwise}", RefusedWarning, stacklevel=3)
    return Study(found.folder, found.exit_code == 0)


def _path(place: Place | None) -> Path | None:
    return None if place is None else Path(place)


def _setting_text(setting: Setting | str) -> str:
    """Setting as an option of the command; JSON is YAML."""
    return setting if isinstance(setting, str) else f"{'.'.join(map(str, setting.path))}={json.dumps(setting.value)}"
