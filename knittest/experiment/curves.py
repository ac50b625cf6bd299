"""Reference curves from CSV files, and forces of strips and frames as what does not depend on the size."""

import math
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.files import data_dir, read_regular
from knittest.experiment.conditions import EXACT, SIZES, UNKNOWN, Conditions, conditions_of, merge_conditions
from knittest.experiment.lab_conditions import GAUGE, WIDTH, StatedDirection, find_direction
from knittest.experiment.lab_rows import read_rows
from knittest.experiment.lab_strips import read_strips
from knittest.experiment.lab_table import ReadOptions
from knittest.experiment.lab_units import decimal_mark, read_number
from knittest.materials.trellis import ANGLE, NORMALISED, normalised_force

Array = NDArray[np.float64]

#: angle [deg] below which the force of a simulated frame is an effect of its start: it halves at half the speed
START = 5.0
#: names of the column of the force
FORCES = ("force_n", NORMALISED)


def read_shear(path: Path) -> tuple[Array, Array, str] | None:
    """Read shear angle [deg], force and its name; None without a column ``shear_angle_deg``.

    Raises :class:`InputError` with the row for text, gaps and angles that do not rise.
    """
    rows = read_rows(path)
    head = next((k for k, (_, cells) in enumerate(rows) if ANGLE in cells), None)
    if head is None:
        return None
    line, names = rows[head]
    force = next((name for name in FORCES if name in names), None)
    if force is None:
        raise InputError(f"{path}:{line}: {ANGLE} needs a column of force; expected one of {', '.join(FORCES)}")
    body = rows[head + 1 :]
    mark = decimal_mark(path, [cell for _, cells in body for cell in cells])
    columns = names.index(ANGLE), names.index(force)
    values = np.array(
        [[read_number(path, n, cells[c] if c < len(cells) else "", mark) for c in columns] for n, cells in body]
    )
    if len(values) < 3:
        raise InputError(f"{path}: {len(values)} points; at least three are needed")
    falls = np.flatnonzero(np.diff(values[:, 0]) <= 0.0)
    if len(falls):
        raise InputError(f"{path}:{body[falls[0] + 1][0]}: {ANGLE} must rise in each row; keep only the first loading")
    return values[:, 0], values[:, 1], force


Kind = Literal["measured", "digitised", "reconstructed", "simulated", "input", "tuned"]
Notes = dict[str, tuple[str, str]]
MAX_BYTES = 10_000_000
#: columns of a tensile force: of the whole strip, and per width
FORCE, FORCE_PER_WIDTH = "force_n", "force_n_per_mm"
DEFAULT_KIND_NOTE = "the file has no '# kind:' line and counts as measured"


@dataclass(frozen=True)
class ReferenceCurve:
    """Curve ``mean`` over ``x``, (n,) each, with its scatter ``sd`` if known; names contain the units.

    ``stated_peak`` is the mean peak (x, y) of the specimens if the mean curve ends before it; ``note`` states
    assumptions and scaling; ``conditions`` are those of the test; ``doubt`` is the reason why nothing is rated.
    """

    kind: Kind
    x: Array
    mean: Array
    sd: Array | None
    x_name: str
    y_name: str
    source: str
    stated_peak: tuple[float, float] | None = None
    note: str = ""
    conditions: Conditions = UNKNOWN
    file: str = ""
    doubt: str = ""

    @property
    def peak(self) -> tuple[float, float]:
        """Peak (x, y) for comparisons: the stated one, or that of the curve."""
        top = int(np.argmax(self.mean))
        return self.stated_peak or (float(self.x[top]), float(self.mean[top]))


def find_curve(path: Path, given: Conditions = UNKNOWN) -> ReferenceCurve:
    """:func:`load_curve` of ``path``, or of that file in the shipped data."""
    return load_curve(resolve_path(path), given)


def resolve_path(path: Path) -> Path:
    """Return ``path``, or the file of that name in the shipped data if only that exists."""
    shipped = data_dir() / path
    return shipped if not path.exists() and shipped.is_file() else path


def load_curve(path: Path, given: Conditions = UNKNOWN) -> ReferenceCurve:
    """Read a curve CSV: ``# kind: ...`` comment lines, a header row, then x, y and optionally the sd of y.

    Lines such as ``# strip_width_mm: 50`` state the conditions of the test; ``given`` and a file or folder named after
    a direction add others. A file without ``# kind`` is read as a laboratory file and counts as measured. Raises
    :class:`InputError` with file and line for an unknown kind, contradicting conditions, text, NaN or a falling x.
    """
    try:
        lines = read_regular(path, MAX_BYTES, "a curve has fewer points").decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        return _read_laboratory_curve(path, given)
    notes = _read_notes(path, lines)
    conditions = merge_conditions(conditions_of(notes), given, str(path))
    per_width = any(FORCE_PER_WIDTH in line for line in lines if not line.startswith("#"))
    if "kind" not in notes and not per_width:
        return _read_laboratory_curve(path, conditions)
    kind, where = notes.get("kind", ("measured", str(path)))
    if kind not in get_args(Kind):
        raise InputError(f"{where}: # kind: {kind}; expected one of {', '.join(get_args(Kind))}")
    (x_name, y_name, *_), rows = _read_table(path, lines)
    source, _ = notes.get("source", (path.name, ""))
    return ReferenceCurve(
        kind, rows[:, 0], rows[:, 1], rows[:, 2] if rows.shape[1] > 2 else None, x_name, y_name, source,  # type: ignore[arg-type]
        _read_peak(path, notes, y_name, conditions), "" if "kind" in notes else DEFAULT_KIND_NOTE,
        _add_direction(conditions, find_direction(path, ())), str(path),
    )  # fmt: skip


def read_simulated(path: Path) -> tuple[dict[str, Array], Conditions] | None:
    """Columns of a curve.csv that a run has written, and the conditions stated above them; None for another file."""
    try:
        lines = read_regular(path, MAX_BYTES, "a curve has fewer points").decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        return None
    head = next((line for line in lines if line.strip() and not line.startswith("#")), "").split(",")
    if head[0] != "time_ms" and "force_mean_n" not in head:
        return None
    names, rows = _read_table(path, lines)
    conditions = _add_direction(conditions_of(_read_notes(path, lines)), find_direction(path, ()))
    return dict(zip(names, rows.T, strict=True)), conditions


def _add_direction(conditions: Conditions, said: StatedDirection | None) -> Conditions:
    return conditions if conditions.direction or said is None else replace(conditions, direction=said.direction)


def _read_notes(path: Path, lines: list[str]) -> Notes:
    """Read the comment lines: name to value and place; raises :class:`InputError` for contradicting conditions."""
    notes: Notes = {}
    for number, line in enumerate(lines, 1):
        if line.startswith("#"):
            key, _, value = (part.strip() for part in line[1:].partition(":"))
            if key in notes and key in (*SIZES, "test", "direction") and notes[key][0] != value:
                raise InputError(f"{path}:{number}: # {key}: {value}, but {notes[key][1]} states {notes[key][0]}")
            notes[key] = value, f"{path}:{number}"
    return notes


def _read_table(path: Path, lines: list[str]) -> tuple[list[str], Array]:
    """Names of the columns and their numbers (n, columns)."""
    body = [(n, line) for n, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    if len(body) < 3:
        raise InputError(f"{path}: a curve needs a header and at least two points")
    names = body[0][1].split(",")
    if len(names) < 2:
        raise InputError(f"{path}:{body[0][0]}: {names[0]!r}: expected the names of two columns, separated by a comma")
    rows = np.array([_read_row(path, n, line, len(names)) for n, line in body[1:]])
    falls = np.flatnonzero(np.diff(rows[:, 0]) <= 0.0)
    if len(falls):
        raise InputError(f"{path}:{body[falls[0] + 2][0]}: {names[0]} must rise from row to row")
    return names, rows


def _read_laboratory_curve(path: Path, conditions: Conditions) -> ReferenceCurve:
    """Read a laboratory file: a column of strain or shear angle and one of force."""
    sheared = read_shear(path)
    if sheared is not None:
        angle, force, name = sheared
        return ReferenceCurve(
            "measured",
            angle,
            force,
            None,
            ANGLE,
            name,
            path.name,
            note=DEFAULT_KIND_NOTE,
            conditions=conditions,
            file=str(path),
        )
    sizes = {what.key: size for what in (WIDTH, GAUGE) if (size := getattr(conditions, what.key)) is not None}
    specimens = read_strips(path, ReadOptions(sizes=sizes, has_column_options=False))
    if len(specimens) > 1:
        raise InputError(f"{path}: {len(specimens)} specimens; average them with knittest data import first")
    (one,) = specimens
    found = replace(_add_direction(conditions, one.said), strip_width_mm=one.width, gauge_length_mm=one.gauge)
    return ReferenceCurve(
        "measured", one.strain, one.force, None, "strain_pct", FORCE, path.name,
        note=DEFAULT_KIND_NOTE, conditions=found,
        file=str(path),
    )  # fmt: skip


def _read_peak(path: Path, notes: Notes, y_name: str, conditions: Conditions) -> tuple[float, float] | None:
    """Strain [%] and force of the mean peak that the header states, in the unit of the column ``y_name``."""
    name = next((n for n in ("peak_force_n", "peak_force_n_per_mm") if n in notes), None)
    if name is None or "fracture_strain_pct" not in notes:
        return None
    texts = (notes[n] for n in ("fracture_strain_pct", name))
    strain, force = (_read_row(path, int(where.rpartition(":")[2]), text, 1)[0] for text, where in texts)
    if name == f"peak_{y_name}":
        return strain, force
    width = conditions.strip_width_mm
    if width is None:
        raise InputError(f"{notes[name][1]}: # {name} with a column {y_name} needs a line '# strip_width_mm: ...'")
    return strain, force / width if name == "peak_force_n" else force * width


def _read_row(path: Path, number: int, line: str, columns: int) -> list[float]:
    with suppress(ValueError):
        values = [float(cell) for cell in line.split(",")]
        if len(values) == columns and np.isfinite(values).all():
            return values
    raise InputError(f"{path}:{number}: {line!r}: expected {columns} finite numbers")


# Forces of strips and frames, independent of their size or for the size of a run. For a strip this is the force per
# width [N/mm], for a frame the normalised shear force F_s L_frame / L_fabric^2 of :mod:`knittest.materials.trellis`.


def to_force_per_width(curve: ReferenceCurve) -> ReferenceCurve:
    """Convert a tensile ``curve`` to force per width [N/mm]; raises :class:`InputError` without a strip width."""
    if curve.y_name == FORCE_PER_WIDTH:
        return curve
    if curve.y_name != FORCE:
        raise InputError(f"{curve.file}: {curve.y_name}; expected {FORCE_PER_WIDTH}, or {FORCE} of a strip")
    width = curve.conditions.strip_width_mm
    if width is None:
        raise InputError(
            f"{curve.file}: the strip width of {FORCE} is unknown; add a line '# strip_width_mm: ...' to the header "
            f"(knittest data import --width writes it), give compare --width, or use a column {FORCE_PER_WIDTH}"
        )
    return _divide(curve, width, FORCE_PER_WIDTH)


def scale_to_width(curve: ReferenceCurve, width: float) -> ReferenceCurve:
    """Scale a tensile ``curve`` to the force [N] of a ``width`` [mm], with a note; raises as
    :func:`to_force_per_width`.
    """
    own = curve.conditions.strip_width_mm
    scaled = _divide(to_force_per_width(curve), 1.0 / width, FORCE)
    if own is None:
        return add_note(scaled, f"given per width, scaled to {width:g} mm")
    return (
        scaled if math.isclose(own, width, rel_tol=EXACT) else add_note(scaled, f"scaled from {own:g} to {width:g} mm")
    )


def normalise_force(curve: ReferenceCurve) -> ReferenceCurve:
    """Convert a frame's ``curve`` to normalised shear force [N/mm]; raises :class:`InputError` without its sides."""
    if curve.y_name == NORMALISED:
        return curve
    fabric, frame = curve.conditions.fabric_side_mm, curve.conditions.frame_side_mm
    if curve.y_name != FORCE or fabric is None or frame is None:
        sides = {"fabric_side_mm": fabric, "frame_side_mm": frame}
        missing = " and ".join(f"'# {name}: ...'" for name, side in sides.items() if side is None)
        raise InputError(
            f"{curve.file or curve.source}: {curve.y_name} of a frame cannot be normalised; use {NORMALISED}, or the "
            f"crosshead {FORCE} with {missing or 'both sides'} in the header (options --fabric-side, --frame-side)"
        )
    angle = np.deg2rad(curve.x)
    force = normalised_force(curve.mean, angle, fabric, frame)
    sd = None if curve.sd is None else normalised_force(curve.sd, angle, fabric, frame)
    note = f"normalised with the tested sides, fabric {fabric:g} mm and frame {frame:g} mm"
    return add_note(replace(curve, mean=force, sd=sd, y_name=NORMALISED), note)


def add_note(curve: ReferenceCurve, note: str) -> ReferenceCurve:
    """Add ``note`` to the note of ``curve``."""
    return replace(curve, note="; ".join(filter(None, (curve.note, note))))


def _divide(curve: ReferenceCurve, size: float, name: str) -> ReferenceCurve:
    peak = curve.stated_peak
    return replace(
        curve, mean=curve.mean / size, sd=None if curve.sd is None else curve.sd / size, y_name=name,
        stated_peak=None if peak is None else (peak[0], peak[1] / size),
    )  # fmt: skip
