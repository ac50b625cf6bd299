"""Reference curves from CSV files, and forces of strips and frames as what does not depend on the size."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.files import data_dir, read_regular
from knittest.experiment.conditions import EXACT, SIZES, UNKNOWN, Conditions, agreed, conditions_of
from knittest.experiment.lab_conditions import GAUGE, WIDTH, Said, said_by
from knittest.experiment.lab_rows import read_rows
from knittest.experiment.lab_strips import read_strips
from knittest.experiment.lab_table import Given
from knittest.experiment.lab_units import decimal_mark, read_number
from knittest.materials.trellis import ANGLE, NORMALISED, normalised_force

Array = NDArray[np.float64]

#: angle [deg] below which a simulated frame's force is that of its start: at half its speed it halves there, the rest
#: stays
START = 5.0
#: names of the column of the force
FORCES = ("force_n", NORMALISED)


def read_shear(path: Path) -> tuple[Array, Array, str] | None:
    """Shear angle [deg], force and the force's name, None if no column is named ``shear_angle_deg``.

    Any delimiter and decimal mark. Raises :class:`InputError` with the row for text, gaps and angles that do not rise.
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
        raise InputError(
            f"{path}:{body[falls[0] + 1][0]}: {ANGLE} must rise from row to row; keep only the first loading"
        )
    return values[:, 0], values[:, 1], force


Kind = Literal["measured", "digitised", "reconstructed", "simulated", "input", "tuned"]
Notes = dict[str, tuple[str, str]]
MAX_BYTES = 10_000_000
#: columns of a tensile force: of the whole strip, and per width
FORCE, FORCE_PER_WIDTH = "force_n", "force_n_per_mm"
TAKEN = "the file has no '# kind:' line and counts as measured"


@dataclass(frozen=True)
class ReferenceCurve:
    """Curve ``mean`` over ``x``, (n,) each, with its scatter ``sd`` if known; names hold the units.

    ``stated_peak`` is the mean of the specimens' own peaks (x, y), where the mean curve ends before it; ``note`` says
    what was taken for granted, or how it was scaled; ``conditions`` are those of the test, ``file`` where it was read;
    ``doubt`` is why nothing is rated against it.
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
        """Peak (x, y) to judge by: the stated one, or that of the curve."""
        top = int(np.argmax(self.mean))
        return self.stated_peak or (float(self.x[top]), float(self.mean[top]))


def find_curve(path: Path, given: Conditions = UNKNOWN) -> ReferenceCurve:
    """:func:`load_curve` of ``path``, or of that file in the shipped data."""
    return load_curve(located(path), given)


def located(path: Path) -> Path:
    """``path`` if it is a file, else the one of that name in the shipped data, if there is one."""
    shipped = data_dir() / path
    return shipped if not path.exists() and shipped.is_file() else path


def load_curve(path: Path, given: Conditions = UNKNOWN) -> ReferenceCurve:
    """Read a curve CSV: ``# kind: ...`` comment lines, a header row, then x, y and optionally the sd of y.

    Lines such as ``# strip_width_mm: 50`` state the conditions of the test; ``given`` adds what they leave open, as
    does a file or folder named after a direction. A file without ``# kind`` is read as a laboratory's, with either
    decimal mark, and taken as measured. Raises :class:`InputError` naming file and line for an unknown kind or
    condition, one that ``given`` contradicts, text, NaN or an x that does not rise.
    """
    try:
        lines = read_regular(path, MAX_BYTES, "a curve has fewer points").decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        return _plain(path, given)
    notes = _notes(path, lines)
    conditions = agreed(conditions_of(notes), given, str(path))
    per_width = any(FORCE_PER_WIDTH in line for line in lines if not line.startswith("#"))
    if "kind" not in notes and not per_width:
        return _plain(path, conditions)
    kind, where = notes.get("kind", ("measured", str(path)))
    if kind not in get_args(Kind):
        raise InputError(f"{where}: # kind: {kind}; expected one of {', '.join(get_args(Kind))}")
    names, rows = _table(path, lines)
    source = notes["source"][0] if "source" in notes else path.name
    return ReferenceCurve(
        kind, rows[:, 0], rows[:, 1], rows[:, 2] if rows.shape[1] > 2 else None, names[0], names[1], source,  # type: ignore[arg-type]
        _stated_peak(path, notes, names[1], conditions), "" if "kind" in notes else TAKEN,
        _named(conditions, said_by(path, ())), str(path),
    )  # fmt: skip


def _named(conditions: Conditions, said: Said | None) -> Conditions:
    """``conditions`` with the direction that the name of a file or folder says, where they state none."""
    return conditions if conditions.direction or said is None else replace(conditions, direction=said.direction)


def _notes(path: Path, lines: list[str]) -> Notes:
    """Name to value and place of the comment lines; raises :class:`InputError` for a condition stated twice."""
    notes: Notes = {}
    for number, line in enumerate(lines, 1):
        if line.startswith("#"):
            key, _, value = (part.strip() for part in line[1:].partition(":"))
            if key in notes and key in (*SIZES, "test", "direction") and notes[key][0] != value:
                raise InputError(f"{path}:{number}: # {key}: {value}, but {notes[key][1]} states {notes[key][0]}")
            notes[key] = value, f"{path}:{number}"
    return notes


def _table(path: Path, lines: list[str]) -> tuple[list[str], Array]:
    """Names of the columns and their numbers (n, columns)."""
    body = [(n, line) for n, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    if len(body) < 3:
        raise InputError(f"{path}: a curve needs a header and at least two points")
    names = body[0][1].split(",")
    if len(names) < 2:
        raise InputError(f"{path}:{body[0][0]}: {names[0]!r}: expected the names of two columns, separated by a comma")
    rows = np.array([_row(path, n, line, len(names)) for n, line in body[1:]])
    falls = np.flatnonzero(np.diff(rows[:, 0]) <= 0.0)
    if len(falls):
        raise InputError(f"{path}:{body[falls[0] + 2][0]}: {names[0]} must rise from row to row")
    return names, rows


def _plain(path: Path, conditions: Conditions) -> ReferenceCurve:
    """A curve of a user's own: a column of strain or shear angle and one of force."""
    sheared = read_shear(path)
    if sheared is not None:
        angle, force, name = sheared
        return ReferenceCurve(
            "measured", angle, force, None, ANGLE, name, path.name, note=TAKEN, conditions=conditions, file=str(path)
        )
    sizes = {what.key: size for what in (WIDTH, GAUGE) if (size := getattr(conditions, what.key)) is not None}
    specimens = read_strips(path, Given(sizes=sizes))
    if len(specimens) > 1:
        raise InputError(f"{path}: {len(specimens)} specimens; average them with knittest data import first")
    (one,) = specimens
    found = replace(_named(conditions, one.said), strip_width_mm=one.width, gauge_length_mm=one.gauge)
    return ReferenceCurve(
        "measured", one.strain, one.force, None, "strain_pct", FORCE, path.name, note=TAKEN, conditions=found,
        file=str(path),
    )  # fmt: skip


def _stated_peak(path: Path, notes: Notes, y_name: str, conditions: Conditions) -> tuple[float, float] | None:
    """Strain [%] and force of the mean peak that the header states, in the unit of the column ``y_name``."""
    name = next((n for n in ("peak_force_n", "peak_force_n_per_mm") if n in notes), None)
    if name is None or "fracture_strain_pct" not in notes:
        return None
    texts = (notes[n] for n in ("fracture_strain_pct", name))
    strain, force = (_row(path, int(where.rpartition(":")[2]), text, 1)[0] for text, where in texts)
    if name == f"peak_{y_name}":
        return strain, force
    width = conditions.strip_width_mm
    if width is None:
        where = notes[name][1]
        raise InputError(f"{where}: # {name} with a column {y_name} needs a line '# strip_width_mm: ...'")
    return strain, force / width if name == "peak_force_n" else force * width


def _row(path: Path, number: int, line: str, columns: int) -> list[float]:
    cells = line.split(",")
    try:
        values = [float(cell) for cell in cells]
    except ValueError:
        values = []
    if len(cells) != columns or len(values) != columns or not np.isfinite(values).all():
        raise InputError(f"{path}:{number}: {line!r}: expected {columns} finite numbers")
    return values


# Forces of strips and frames of any size as what does not depend on the size, and for the size of a run.
#
# A strip carries its force over its width: F / b [N/mm]. A frame is judged by the normalised shear force F_s L_frame /
# L_fabric^2 [N/mm] of :mod:`knittest.materials.trellis`.


def per_width(curve: ReferenceCurve) -> ReferenceCurve:
    """A tensile ``curve`` as force per width [N/mm]; raises :class:`InputError` where its strip has no width."""
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
    return _divided(curve, width, FORCE_PER_WIDTH)


def for_width(curve: ReferenceCurve, width: float) -> ReferenceCurve:
    """A tensile ``curve`` as force [N] of a strip of ``width`` [mm], and in its note of which width it was.

    Raises as :func:`per_width` does.
    """
    own = curve.conditions.strip_width_mm
    scaled = _divided(per_width(curve), 1.0 / width, FORCE)
    if own is None:
        return noted(scaled, f"given per width, scaled to {width:g} mm")
    return scaled if math.isclose(own, width, rel_tol=EXACT) else noted(scaled, f"scaled from {own:g} to {width:g} mm")


def normalised(curve: ReferenceCurve) -> ReferenceCurve:
    """A frame's ``curve`` as normalised shear force [N/mm]; raises :class:`InputError` for a force [N] of a frame or
    fabric of unknown side.
    """
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
    return noted(replace(curve, mean=force, sd=sd, y_name=NORMALISED), note)


def noted(curve: ReferenceCurve, note: str) -> ReferenceCurve:
    """``curve`` with ``note`` added to its own."""
    return replace(curve, note="; ".join(filter(None, (curve.note, note))))


def _divided(curve: ReferenceCurve, size: float, name: str) -> ReferenceCurve:
    peak = curve.stated_peak
    return replace(
        curve, mean=curve.mean / size, sd=None if curve.sd is None else curve.sd / size, y_name=name,
        stated_peak=None if peak is None else (peak[0], peak[1] / size),
    )  # fmt: skip
