"""The files summary.json, whose keys are a contract with other programs, and manifest.json, which says where a run
comes from and how it ended.
"""

import os
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import knittest
from knittest.base.errors import KnittestError, OutOfTolerance
from knittest.base.history import Cost, Quality, of_all
from knittest.base.interrupts import INTERRUPTED, Interrupted
from knittest.base.machine import host_name
from knittest.base.result_rows import folded, spread_of
from knittest.base.summary import ComparisonRow, CostBlock, Limit, Spread, Status, Summary
from knittest.config.gates import GATES, Loosened, loosened
from knittest.config.run import Run
from knittest.export import identity

Results = Mapping[str, float]


def ensemble_results(specimens: Sequence[Results]) -> dict[str, Spread]:
    """Mean, sd and values of each result over the specimens, all of which have the same keys; sd is 0 for one.

    Of a result that one of them lacks (nan) neither mean nor sd is known.
    """
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

    A run that fails a quality gate has its comparison refused: ``refused`` lists why, and ``comparison`` stays empty.
    ``limits`` lists those that are looser than the preset's. ``kinds`` are those of results that could be compared but
    have no reference; ``assumed`` are the inputs that decide the results and that nobody vouches for; ``rest`` are the
    numbers of the state that each specimen of yarns started from.
    """
    found: Summary = {
        "rig": run.rig.kind,
        "variant": run.fabric.experiment_variant or run.fabric.name,
        "scale": run.model.scale,
        "direction": run.direction,
        "status": "completed",
        "results": _folded(specimens),
        "quality": _quality(quality),
        "cost": _cost(cost),
        "comparison": [] if quality.failures else [_row(row) for row in comparison],
        "kinds": {} if quality.failures else dict(kinds or {}),
        "assumed": list(assumed),
        "refused": list(quality.failures),
        "warnings": list(quality.warnings),
        "limits": [_limit(run, one) for one in loosened(run)],
    }
    if any(rest):
        found["rest"] = _folded(of_all(rest))
    return found


def _folded(specimens: Sequence[Results]) -> dict[str, object]:
    """Numbers of one specimen, or mean, sd and values of several, as the file has them."""
    return folded(specimens[0] if len(specimens) == 1 else ensemble_results(specimens))


def _quality(quality: Quality) -> dict[str, float | bool]:
    return {gate.key: getattr(quality, gate.key) for gate in GATES} | {"quasi_static": quality.quasi_static}


def _limit(run: Run, found: Loosened) -> Limit:
    """A limit looser than the preset's, and whether that was accepted."""
    return {
        "name": found.name, "value": found.value, "preset": found.preset, "unit": found.unit,
        "accepted": run.accept_limits,
    }  # fmt: skip


def _cost(cost: Cost) -> CostBlock:
    return {
        "wall_s": cost.wall_s,
        "cpu_s": cost.cpu_s,
        "compile_s": cost.compile_s,
        "steps": cost.steps,
        "elements": cost.elements,
        "element_steps_per_s": cost.element_steps_per_s,
        "threads": cost.threads,
    }


def _row(row: ComparisonRow) -> ComparisonRow:
    """The row with the contract's keys only, in its order; a missing one is a ``KeyError`` here, not at a reader."""
    optional = ComparisonRow.__optional_keys__
    keys = [key for key in ComparisonRow.__annotations__ if key in row or key not in optional]
    return {key: row[key] for key in keys}  # type: ignore


def first_manifest(
    run: Run, config_text: str, threads: int, data_files: Iterable[Path], cell: str | None
) -> dict[str, Any]:
    """The manifest of a run that begins; ``cell`` is the digest of its relaxed cell, None for shells."""
    return {
        "status": "running",
        "version": knittest.__version__,
        "git_commit": identity.git_commit(),
        "config_sha256": identity.sha256_text(config_text),
        "data_sha256": identity.sha256_files(data_files),
        "cell_sha256": cell,
        "seed": run.variability.seed,
        "cpu": identity.cpu_model(),
        "cores": identity.cores(),
        "threads": threads,
        "libraries": identity.library_versions(),
        "pid": os.getpid(),
        "host": host_name(),
        "started": now(),
        "ended": None,
        "exit_code": None,
        "message": "",
    }


def restarted_manifest(manifest: Mapping[str, Any], threads: int, notes: Mapping[str, Any]) -> dict[str, Any]:
    """``manifest`` of a run that goes on, with ``notes`` on from where and what was changed by force."""
    again = {"status": "running", "ended": None, "exit_code": None, "message": "", "threads": threads}
    here = {"pid": os.getpid(), "host": host_name()}
    return {**manifest, **again, **here, "resumed": [*manifest.get("resumed", []), {"time": now(), **notes}]}


def ending(error: BaseException | None) -> tuple[Status, int, str]:
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


def now() -> str:
    """Present time in ISO 8601, with its time zone."""
    return datetime.now().astimezone().isoformat(timespec="seconds")
