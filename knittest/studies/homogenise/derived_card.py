"""Macro material cards that a fabric does not state: derived from a meso cell when a run needs them, and cached."""

import hashlib
import json
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numba
import numpy as np
from pydantic import ValidationError

from knittest.base.cache import Damaged, cache_folder, load_cached, save_cached
from knittest.base.errors import InputError, KnittestError, NumericalError, ResourceError
from knittest.base.kinds import kinds
from knittest.base.progress import tell
from knittest.config.aliases import FIELDS
from knittest.config.fabric import CARD, Direction, Fabric
from knittest.config.messages import input_error
from knittest.config.quality_checks import FROM_YARNS
from knittest.config.run import Run, Variability
from knittest.config.settings import Layers, leaf_values
from knittest.config.suspicious_values import REJECTED, first_failure
from knittest.config.yaml_writer import dump_mapping
from knittest.fabric.topology import draw
from knittest.laboratory.cell.config import CellRun
from knittest.laboratory.shear_law_end import end_with_shear_law
from knittest.studies.homogenise import card
from knittest.studies.homogenise.card import Array, FinishedTest, tension_curve
from knittest.studies.homogenise.plan import (
    ANGLE,
    PLANNED_TESTS,
    PlannedTest,
    Request,
    angles_without_inlays,
    cell_run,
    coupled_tests,
)
from knittest.studies.trials.pool import LocalPool
from knittest.studies.trials.runner import TRIALS, handle_signals, run_with_overview
from knittest.studies.trials.trial import Record, code_digest, trial_of

#: size of the cell, and time [s] that one path of it may take
PRESET, TIME_LIMIT = "quick", 1800.0
#: share of the speed, largest safety factor of the time step and factor on the beams in a loop, for attempts at a path
#: that is rejected or fails: the hooks of thin loops need more beams than usual
ATTEMPTS = ((1.0, 1.0, 1.0), (0.5, 0.6, 1.0), (1.0, 1.0, 1.4), (0.5, 0.6, 1.4))
#: factor on the largest strain of a path without yarn failure, and the largest strain [%]: thick loops give thin inlays
#: more waviness than their crimp
FARTHER, FARTHEST = 1.6, 50.0
#: yarn diameter over loop length below which loops are slack: cells failed at 0.012 and 0.015, none from 0.019 on
THIN = 0.018
#: shows a text once
_tell_once = cache(tell)
#: paths from which each part of a card is derived; a fabric without inlays in a direction has others for its tension
PATHS: Mapping[str, Sequence[PlannedTest]] = dict(
    zip(CARD, (PLANNED_TESTS[:2], PLANNED_TESTS[3:], PLANNED_TESTS[2:3]), strict=True)
)
#: width [mm] of the strip whose yarns scatter, as in tensile tests
STRIP = 50.0
#: old name of each renamed field of the yarns, as in the digests of earlier versions
OLD_PATHS = {f"{holder}.{new}": f"{holder}.{old}" for (holder, old), new in FIELDS.items() if holder == "knitting"}
#: fields of a fabric without influence on its cell
FIELDS_NOT_IN_KEY = {"name", "title", "macro", "experiment", "experiment_variant", "rigs"}
DIGITS = 12
#: note of a law of two strains that leaves out paths
WITHOUT = ", without the paths at "


class PathResult(NamedTuple):
    """Result of one path: force per width ``y`` [N/mm] over ``x``, strain [%] or angle [deg]; or a stiffness [N mm];
    or forces (n, 2) over strains [-] of warp and weft, (n, 2).

    ``rejected`` names failed quality checks of the path.
    """

    x: Array
    y: Array
    rejected: str = ""


def complete_cards(runs: Sequence[Run], quiet: bool = False) -> list[Run]:
    """Complete the macro material cards of ``runs``: derive parts that are missing or were derived from other yarns.

    A run that does not state its largest shear angle ends with its shear law. Raises :class:`NumericalError` if a path
    of the cell has no result, :class:`InputError` for a fabric that cannot have a cell or excludes a derived card.
    """
    found: dict[str, dict[PlannedTest, PathResult]] = {}
    completed = []
    for run in runs:
        parts = missing_parts(run)
        if parts:
            numbers = found.setdefault(_digest(run.fabric), {})
            numbers |= _path_results(run.fabric, [p for p in _paths_of(run.fabric, parts) if p not in numbers], quiet)
            _check_not_rejected(run, parts, numbers)
            run = _set_card_parts(run, parts, numbers)
        run, note = end_with_shear_law(run)
        if note and not quiet:
            _tell_once(f"{run.fabric.name}: {note}")
        completed.append(run)
    return completed


def missing_parts(run: Run) -> tuple[str, ...]:
    """Parts of the card that ``run`` needs and its fabric does not state, or that were derived from other yarns."""
    macro = run.fabric.macro
    if run.model.scale != "macro":
        return ()
    references = {
        "tension": [
            one.ref
            for one in (*(macro.tension or {}).values(), macro.biaxial)
            if one is not None and not isinstance(one, str)
        ],
        "bending_stiffness": [] if macro.bending_stiffness is None else [macro.bending_stiffness.warp.ref],
        "shear": [] if macro.shear is None else [macro.shear.ref],
    }
    own = tuple(FROM_YARNS + digest for digest in (_digest(run.fabric), _digest(run.fabric, OLD_PATHS)))
    derived = {name: [ref for ref in refs if ref.startswith(FROM_YARNS)] for name, refs in references.items()}
    stale = [name for name, refs in derived.items() if not all(ref.startswith(own) for ref in refs)]
    return tuple(name for name in CARD if name in macro.missing_card_parts or name in stale)


def _check_not_rejected(run: Run, parts: Sequence[str], numbers: Mapping[PlannedTest, PathResult]) -> None:
    """Raise :class:`NumericalError` for a rejected path that decides the result of ``run``."""
    decisive = kinds()[run.rig.kind].deciding.get("macro", ())
    for part in (part for part in parts if any(field.startswith(f"macro.{part}") for field in decisive)):
        for piece in _paths_of(run.fabric, [part]):
            if rejected := numbers[piece].rejected:
                raise NumericalError(
                    _failure_text(run.fabric, piece, f"failed a quality check: {first_failure(rejected)}")
                )


def paths_to_run(run: Run) -> list[Run]:
    """Runs of the cell that ``run`` needs; none if its card is stated or cached."""
    pieces = [p for p in _paths_of(run.fabric, missing_parts(run)) if _load(run.fabric, p) is None]
    with tempfile.TemporaryDirectory() as folder:
        return [cell_run(_request(run.fabric, Path(folder)), piece) for piece in pieces]


def _paths_of(fabric: Fabric, parts: Iterable[str]) -> list[PlannedTest]:
    paths, angles = dict(PATHS), angles_without_inlays(fabric)
    if angles:
        paths["tension"] = coupled_tests(angles)[: len(angles)]
    return [piece for part in parts for piece in paths[part]]


def _path_results(fabric: Fabric, pieces: Sequence[PlannedTest], quiet: bool) -> dict[PlannedTest, PathResult]:
    """Results of the paths ``pieces``, from the cache or from new runs."""
    found = {piece: numbers for piece in pieces if (numbers := _load(fabric, piece)) is not None}
    outcomes: dict[PlannedTest, PathResult | Record] = {}
    left = [piece for piece in pieces if piece not in found]
    if not left:
        return found
    if not quiet:
        tell(f"fabric {fabric.name}: deriving its macro material card from {len(left)} paths of a meso cell")
    with tempfile.TemporaryDirectory() as folder, handle_signals():
        farther = dict.fromkeys(left, 1.0)
        for tried in ATTEMPTS:
            if outcomes and not quiet:
                speed, safety, finer = tried
                names = ", ".join(piece.name for piece in left)
                more = (
                    f"{speed:g} of the speed, safety <= {safety:g}, {finer:g} times the beams in a loop, larger strain"
                )
                tell(f"fabric {fabric.name}: no valid result of {names} yet; next attempt with {more}")
            for piece, outcome in _run_paths(fabric, left, Path(folder), tried, farther, quiet).items():
                outcomes[piece] = outcome
                if not isinstance(outcome, Record):
                    arrays = {name: np.asarray(value) for name, value in outcome._asdict().items()}
                    save_cached(_path(fabric, piece), _key(fabric, piece), arrays)
            open_paths = {
                p for p, r in outcomes.items() if (r.status == "failed" if isinstance(r, Record) else r.rejected)
            }
            if not (left := [piece for piece in left if piece in open_paths]):
                break
    for piece, outcome in outcomes.items():
        if isinstance(outcome, Record):
            raised: dict[str, type[KnittestError]] = {"invalid": InputError, "blocked": ResourceError}
            text = _failure_text(fabric, piece, f"{outcome.status}: {outcome.reason}")
            raise raised.get(outcome.status, NumericalError)(text)
        found[piece] = outcome
    return found


def _run_paths(
    fabric: Fabric, pieces: Sequence[PlannedTest], folder: Path, tried: tuple[float, float, float],
    farther: dict[PlannedTest, float], quiet: bool,
) -> dict[PlannedTest, PathResult | Record]:  # fmt: skip
    """Run paths with one of :data:`ATTEMPTS`; records of those without a result.

    ``farther`` has the factor on the largest strain of each path, which grows if no yarn failed.
    """
    (speed, safety, finer), runs = tried, {}
    for piece in pieces:
        run = cell_run(_request(fabric, folder), piece)
        sets = [
            f"solver.speed={speed * run.solver.speed!r}", f"solver.safety={min(safety, run.solver.safety)!r}",
            f"model.meso.elements_per_loop={2 * round(0.5 * finer * run.model.meso.elements_per_loop)}",
        ]  # fmt: skip
        if farther[piece] > 1.0:
            assert isinstance(run, CellRun)
            sets.append(f"rig.max_strain={min(farther[piece] * run.rig.max_strain, FARTHEST)!r}")
        if piece.kind == "picture-frame" and tried != ATTEMPTS[0]:  # loops that are sheared far may snap
            sets.append(f"rig.max_angle={ANGLE!r}")
        runs[piece] = cell_run(_request(fabric, folder, tuple(sets)), piece)
    trials = {piece: trial_of(run, f"card, {piece.name}") for piece, run in runs.items()}
    by_key = {trial.key: piece for piece, trial in trials.items()}
    outcomes: dict[PlannedTest, PathResult | Record] = {}

    def note(record: Record) -> None:
        piece = by_key[record.key]
        outcomes[piece] = record
        if record.status not in ("completed", "refused"):
            return
        results = replace(record, status="completed").results
        tested = FinishedTest(runs[piece], folder / TRIALS / record.key, results, record.key)
        try:
            outcomes[piece] = _read_result(piece, tested)._replace(rejected=record.reason)
        except NumericalError as error:
            outcomes[piece] = replace(record, status="failed", reason=str(error))
            farther[piece] *= FARTHER if isinstance(error, card.NoYarnFailureError) else 1.0

    pool = LocalPool(numba.get_num_threads(), 1)
    run_with_overview(list(trials.values()), folder, pool, limit=TIME_LIMIT, quiet=quiet, check=note)
    return outcomes


def _read_result(piece: PlannedTest, tested: FinishedTest) -> PathResult:
    if piece.angle is not None:
        return PathResult(*card.strain_path(tested))
    if piece.direction and piece.kind == "tensile":
        card.tension_of(tested)  # raises if no yarn failed
        return PathResult(
            *tension_curve(*_scattered_tension(tested.run.fabric, piece.direction, *card.tension_to_peak(tested)))
        )
    if piece.kind == "cantilever":
        return PathResult(np.zeros(0), np.array([card.bending_stiffness(tested)]))
    angle, force = card.shear_law(tested)
    return PathResult(angle, force) if angle[0] == 0.0 else PathResult(np.append(0.0, angle), np.append(0.0, force))


def _scattered_tension(fabric: Fabric, direction: Direction, strain: Array, force: Array) -> tuple[Array, Array]:
    """Strain [%] and force [N/mm] of a strip of yarns with scatter of strength and slack, from those of equal yarns,
    the first of which fail at the last strain: a bundle (Daniels, 1945) of the yarns of a standard strip.

    Layers share the force by the axial stiffness of their yarns.
    """
    pitches, layers = round(STRIP * fabric.density_per_mm.of(direction)), fabric.inlays_along(direction)
    yarns = [(one, one.count(pitches) or 1) for one in layers]
    drawn = [draw(fabric, Variability(), one.name, count, 0) for one, count in yarns]
    if all(np.ptp(some.fracture_strain) == 0.0 and not some.slack.any() for some in drawn):
        return strain, force
    straight = [(1.0 + one.crimp) * (1.0 + one.yarn.fracture_strain_fraction) for one in layers]
    longer = [(1.0 + strain[-1] / 100.0) * (1.0 + one.crimp) / min(straight) for one in layers]
    slack = [100.0 * some.slack for some in drawn]
    breaks = [
        100.0 * (own * (1.0 + some.fracture_strain) - 1.0) + loose
        for own, some, loose in zip(longer, drawn, slack, strict=True)
    ]
    grid = np.union1d(strain, np.concatenate([one[one < strain[-1]] for one in breaks]))
    stiffness = np.array([count * one.yarn.youngs_modulus_mpa * one.yarn.load_area_mm2 for one, count in yarns])
    held = np.zeros(len(grid))
    for share, loose, ends in zip(stiffness / stiffness.sum(), slack, breaks, strict=True):
        held += share * (np.interp(grid[:, None] - loose, strain, force) * (grid[:, None] <= ends)).mean(axis=1)
    return grid, held


def _bundle_strain(fabric: Fabric, direction: Direction, path: PathResult) -> float:
    """Strain [%] at which equal inlays along ``direction`` carry the strength of the bundle of those that scatter."""
    own = 0 if direction == "warp" else 1
    strain, force = 100.0 * path.x[:, own], np.maximum.accumulate(path.y[:, own])
    _, held = _scattered_tension(fabric, direction, strain, force)
    return float(strain[np.argmax(force >= held.max())])


def _failure_text(fabric: Fabric, piece: PlannedTest, reason: str) -> str:
    part = next(part for part in CARD if piece in _paths_of(fabric, [part]))
    return (
        f"fabric {fabric.name}: macro.{part} cannot be derived from the yarns. The {piece.name} path of a cell "
        f"{reason}.{_thin_loop_note(fabric)} Add macro.{part} to the fabric file, or use --scale meso"
    )


def _thin_loop_note(fabric: Fabric) -> str:
    """Say that the loops are slack where their yarn is thin, and what to change; else empty."""
    share = fabric.knitting.beam_diameter_mm / fabric.loop_length_mm
    if share >= THIN:
        return ""
    return (
        f" The loops are slack: the knitting yarn is {100.0 * share:.1f} % of loop_length thick (variant 1: 3.5 %), so "
        "hardly any force acts between the yarns. Use a thicker knitting yarn, or a shorter loop_length with higher "
        "warp_density and weft_density."
    )


def _set_card_parts(run: Run, parts: Sequence[str], numbers: Mapping[PlannedTest, PathResult]) -> Run:
    """Set ``parts`` of the card of ``run`` from the ``numbers`` of paths; raises :class:`InputError`."""
    data: dict[str, Any] = run.model_dump(mode="json")
    macro = data["fabric"]["macro"]
    for part in parts:
        macro |= _fields(part, run.fabric, numbers)
    try:
        return type(run).model_validate(data).model_copy(update={"rig": run.rig})  # keeps what the user stated
    except ValidationError as error:
        layers = Layers()
        layers.lay(data, lambda path: "the card derived from the yarns")
        raise input_error(error, layers) from None


def _fields(part: str, fabric: Fabric, numbers: Mapping[PlannedTest, PathResult]) -> dict[str, Any]:
    """Fields of ``part`` of a card, marked as derived."""
    made, ends, digest = {}, {}, _digest(fabric)
    pieces = _paths_of(fabric, [part])
    if pieces[0].angle is not None:
        paths = [(numbers[piece].x, numbers[piece].y) for piece in pieces]
        table, _, left_out = card.biaxial_table(paths, card.optional_paths(pieces), card.grid_of(fabric))
        without = ", ".join(f"{pieces[k].angle:g}" for k in left_out)
        if without:
            _tell_once(
                f"fabric {fabric.name}: macro.biaxial leaves out the paths at {without} deg, on which loops jump"
            )
        strain, force = table.samples
        rows = [[_round_number(v) for v in row] for row in np.column_stack([100.0 * strain, force])]
        failed_paths = (numbers[piece].rejected for piece in pieces if numbers[piece].rejected)
        ref = _derived_ref(digest, next(failed_paths, ""), f"{WITHOUT}{without} deg" if without else "")
        last = {d: 100.0 * numbers[piece].x[-1].max() for d, piece in card.ALONG.items()}
        failed = [d for d in card.ALONG if card.inlays_fail(fabric, d, last[d])]
        strains = {d: _bundle_strain(fabric, d, numbers[card.ALONG[d]]) for d in failed}
        return {"biaxial": {"points": rows, "source": "derived", "ref": ref}} | card.coupled_fracture(strains, ref)
    for piece in pieces:
        x, y, rejected = numbers[piece]
        origin = {"source": "derived", "ref": _derived_ref(digest, rejected)}
        points = [[_round_number(a), _round_number(b)] for a, b in zip(x, y, strict=False)]
        if part == "shear":
            return {part: {"kind": "table", "points": points, **origin}}
        tension = part == "tension"
        made[piece.direction] = {"points": points, **origin} if tension else card.bending_quantity(y[-1], origin["ref"])
        ends[piece.direction] = {"value": _round_number(x[-1]), **origin} if tension else {}
    return {part: made, "fracture_strain": ends} if part == "tension" else {part: made}


def _derived_ref(digest: str, rejected: str = "", note: str = "") -> str:
    return f"{FROM_YARNS}{digest}, preset {PRESET}{note}" + (f"{REJECTED}{rejected}" if rejected else "")


def _round_number(value: float) -> float:
    return float(f"{value:.6g}")


def _request(fabric: Fabric, folder: Path, sets: tuple[str, ...] = ()) -> Request:
    """Write the file of ``fabric`` to ``folder``; returns the request of its cell."""
    path = folder / "fabric.yaml"
    data = _yarn_fields(fabric) | {"name": fabric.name}
    path.write_text(dump_mapping(data, ("fabric",)), encoding="utf-8")
    return Request(fabric=path, preset=PRESET, sets=sets, source="cell")


def _yarn_fields(fabric: Fabric) -> dict[str, Any]:
    """Fields of ``fabric`` that determine its cell."""
    return fabric.model_dump(mode="json", exclude=FIELDS_NOT_IN_KEY, exclude_none=True)


def _digest(fabric: Fabric, names: Mapping[str, str] = MappingProxyType({})) -> str:
    """Digest of the yarns of ``fabric``, with other ``names`` of some fields."""
    numbers = sorted((names.get(name, name), str(value)) for name, value in leaf_values(_yarn_fields(fabric)))
    return hashlib.sha256(json.dumps(numbers).encode()).hexdigest()[:DIGITS]


def _key(fabric: Fabric, piece: PlannedTest) -> str:
    """Digest of the yarns of ``fabric``, the path, and the sources that derive its numbers."""
    digest = hashlib.sha256(f"{_digest(fabric)} {piece.name} {PRESET} {ATTEMPTS} {code_digest()}".encode())
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()[: 2 * DIGITS]


def _path(fabric: Fabric, piece: PlannedTest) -> Path | None:
    folder = cache_folder("cards")
    return None if folder is None else folder / f"{_key(fabric, piece)}.npz"


def _load(fabric: Fabric, piece: PlannedTest) -> PathResult | None:
    path = _path(fabric, piece)
    try:
        arrays = load_cached(path, _key(fabric, piece))
        return None if arrays is None else PathResult(arrays["x"], arrays["y"], str(arrays["rejected"]))
    except (Damaged, KeyError) as error:
        tell(f"{path}: {error}: this cached part of a card is ignored and derived again")
        return None
