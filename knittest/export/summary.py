"""Contents of summary.json, whose keys are fixed for other programs, and of manifest.json."""

import os
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import knittest
from knittest.base.errors import KnittestError, OutOfTolerance
from knittest.base.history import Cost, Quality, with_common_names
from knittest.base.interrupts import INTERRUPTED, Interrupted
from knittest.base.machine import available_cores, host_name
from knittest.base.result_rows import fold_results, spread_of
from knittest.base.summary import ComparisonRow, CostBlock, Limit, Spread, Status, Summary
from knittest.config.quality_checks import SOLVER_CHECKS, relaxed_limits
from knittest.config.run import Run
from knittest.export import identity

Results = Mapping[str, float]


def ensemble_results(specimens: Sequence[Results]) -> dict[str, Spread]:
    """Mean, sd and values of each result over the specimens; sd is 0 for one specimen, nan if one lacks the result."""
    return {key: spread_of([float(specimen[key]) for specimen in specimens]) for key in specimens[0]}


def build_summary(
    run: Run,
    specimens: Sequence[Results],
    quality: Quality,
    cost: Cost,
    comparison: Sequence[ComparisonRow],
    kinds: Mapping[str, str] | None = None,
    assumed: Sequence[str] = (),
    rest: Sequence[Results] = (),
) -> Summary:
    """Build ``summary.json`` from the results of one specimen or, as mean, sd and values, of several.

    If a quality check fails, ``refused`` lists why and ``comparison`` is empty. ``limits`` lists the limits above the
    preset's, ``kinds`` the kinds of results without a reference, ``assumed`` the assumed inputs, and ``rest`` the
    initial equilibrium of each meso specimen.
    """
    found: Summary = {
        "rig": run.rig.kind,
        "variant": run.fabric.experiment_variant or run.fabric.name,
        "scale": run.model.scale,
        "direction": run.direction,
        "status": "completed",
        "results": _fold_specimens(specimens),
        "quality": {check.key: getattr(quality, check.key) for check in SOLVER_CHECKS}
        | {"quasi_static": quality.quasi_static},
        "cost": {key: getattr(cost, key) for key in CostBlock.__annotations__},  # type: ignore[typeddict-item]
        "comparison": [] if quality.failures else [_fixed_keys(row) for row in comparison],
        "kinds": {} if quality.failures else dict(kinds or {}),
        "assumed": list(assumed),
        "refused": list(quality.failures),
        "warnings": list(quality.warnings),
        "limits": [
            Limit(name=o.name, value=o.value, preset=o.preset, unit=o.unit, accepted=run.accept_limits)
            for o in relaxed_limits(run)
        ],
    }
    if any(rest):
        found["rest"] = _fold_specimens(with_common_names(rest))
    return found


def _fold_specimens(specimens: Sequence[Results]) -> dict[str, object]:
    """Return the numbers of one specimen, or mean, sd and values of several, as in the file."""
    return fold_results(specimens[0] if len(specimens) == 1 else ensemble_results(specimens))


def _fixed_keys(row: ComparisonRow) -> ComparisonRow:
    """Return the row with the fixed keys only, in their order; raises ``KeyError`` for a missing one."""
    optional = ComparisonRow.__optional_keys__
    keys = [key for key in ComparisonRow.__annotations__ if key in row or key not in optional]
    return {key: row[key] for key in keys}  # type: ignore


def first_manifest(
    run: Run, config_text: str, threads: int, data_files: Iterable[Path], cell: str | None
) -> dict[str, Any]:
    """Return the manifest of a new run; ``cell`` is the digest of its relaxed cell, None at macro scale."""
    return {
        "status": "running",
        "version": knittest.__version__,
        "git_commit": identity.git_commit(),
        "config_sha256": identity.sha256_text(config_text),
        "data_sha256": identity.sha256_files(data_files),
        "cell_sha256": cell,
        "seed": run.variability.seed,
        "cpu": identity.cpu_model(),
        "cores": available_cores(),
        "threads": threads,
        "libraries": identity.library_versions(),
        "pid": os.getpid(),
        "host": host_name(),
        "started": timestamp(),
        "ended": None,
        "exit_code": None,
        "message": "",
    }


def resume_manifest(manifest: Mapping[str, Any], threads: int, notes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the ``manifest`` of a resumed run, with ``notes`` on the checkpoint and on forced changes."""
    again = {"status": "running", "ended": None, "exit_code": None, "message": "", "threads": threads}
    here = {"pid": os.getpid(), "host": host_name()}
    return {**manifest, **again, **here, "resumed": [*manifest.get("resumed", []), {"time": timestamp(), **notes}]}


def exit_status(error: BaseException | None) -> tuple[Status, int, str]:
    """Status, exit code and message for the exception that ended a run."""
    if error is None:
        return "completed", 0, ""
    if isinstance(error, OutOfTolerance):
        return "completed", error.exit_code, str(error)
    if isinstance(error, KnittestError):
        return "failed", error.exit_code, str(error)
    if isinstance(error, KeyboardInterrupt) or (isinstance(error, SystemExit) and error.code == INTERRUPTED):
        return "interrupted", INTERRUPTED, str(error) if isinstance(error, Interrupted) else "stopped by a signal"
    return "failed", 1, f"{type(error).__name__}: {error}"


def timestamp() -> str:
    """Present time in ISO 8601, with its time zone."""
    return datetime.now().astimezone().isoformat(timespec="seconds")
