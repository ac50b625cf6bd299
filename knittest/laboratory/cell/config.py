"""Config of the cell test: fields, presets, paths of the mean deformation from CSV files."""

import csv
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from knittest.base.errors import InputError
from knittest.base.kinds import Stated
from knittest.config.base import BoundsError, Kernel, number
from knittest.config.rigs import Rig
from knittest.config.run import Run

#: repeats either way
REPEATS = {"quick": 1, "standard": 2, "paper": 2}
#: speed [m/s] of 100 mm of fabric, and start [ms]: at half of it forces stay within 0.5 %
SPEED = {"shear": 2.4, "warp": 0.4, "weft": 0.4, "biaxial": 0.4, "bending": 0.25, "compaction": 1.5}
FROM_A_FILE, START = 2.4, 4.0
#: nodes of a larger cell follow later: these go slower by its repeats
SLOW_PATHS = ("shear",)
#: paths that pull no yarn: a wave of four beams, as in frames
FINE_MESH_PATHS = ("warp", "weft", "biaxial")


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset`` for the path that is stated: it takes 10 to 60 ms."""
    path = str(stated("path") or "shear")
    model = {} if path in FINE_MESH_PATHS or path not in SPEED else {"meso": {"elements_per_wave": 4}}
    slower = path in SLOW_PATHS or path not in SPEED
    speed = SPEED.get(path, FROM_A_FILE) / (REPEATS[preset] if slower else 1)
    return {
        "rig": {"wales": REPEATS[preset], "courses": REPEATS[preset]},
        "model": model,
        "solver": {"speed": speed, "ramp": START, "damping": 0.01, "safety": 0.9},
    }


HEADER = ["fraction", "f_xx", "f_xy", "f_yx", "f_yy"]
Row = tuple[float, float, float, float, float]


def read_steps(name: str) -> list[Row]:
    """Rows of time share and mean gradient in file ``name``; raises :class:`InputError` that names the line."""
    try:
        lines = list(csv.reader(Path(name).read_text(encoding="utf-8").splitlines()))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"rig.path = {name}: cannot be read as text: {error}") from None
    numbered = [(k, [v.strip() for v in line]) for k, line in enumerate(lines, 1) if any(v.strip() for v in line)]
    if not numbered or numbered[0][1] != HEADER:
        raise InputError(f"{name}, line 1: expected the header {','.join(HEADER)}")
    rows: list[Row] = []
    for at, line in numbered[1:]:
        where = f"{name}, line {at}"
        try:
            fraction, xx, xy, yx, yy = row = tuple(float(v) for v in line)
        except ValueError:
            row = ()
        if not row or not all(map(isfinite, row)):
            raise InputError(f"{where}: {','.join(line)}: expected {len(HEADER)} finite numbers, {','.join(HEADER)}")
        if not rows and row != (0.0, 1.0, 0.0, 0.0, 1.0):
            raise InputError(f"{where}: the path begins with the undeformed fabric: expected 0,1,0,0,1")
        if rows and not rows[-1][0] < fraction <= 1.0:
            raise InputError(f"{where}: fraction = {fraction:g}: expected more than {rows[-1][0]:g}, and at most 1")
        if not xx * yy - xy * yx > 0.0:
            raise InputError(f"{where}: the gradient has the determinant {xx * yy - xy * yx:g}: expected more than 0")
        rows.append((fraction, xx, xy, yx, yy))
    if len(rows) < 2 or rows[-1][0] != 1.0:
        raise InputError(f"{name}: {len(rows)} rows; expected at least 2, the last of fraction 1")
    return rows


PathName = Literal["shear", "warp", "weft", "biaxial", "bending", "compaction", "steps"]
#: axial stiffness is what these pull at: they keep all of it
TENSION_PATHS = ("warp", "weft", "biaxial", "steps")


class CellRig(Rig):
    """Cell: some loops of the fabric without an edge, whose images follow the mean deformation."""

    kind: Literal["cell"] = "cell"
    path: PathName = Field(
        "shear",
        description="mean deformation: shear as a trellis; warp, weft, biaxial: stretched; bending; compaction between "
        "plates; or steps, a CSV file of which may stand here",
    )
    steps: list[tuple[float, float, float, float, float]] = Field(
        default_factory=list,
        description="path steps: rows of the share of the time and the mean gradient F_xx, F_xy, F_yx, F_yy; "
        "x is along the weft, y along the warp",
    )
    wales: int = Field(2, ge=1, le=12, description="repeats across the wales")
    courses: int = Field(2, ge=1, le=12, description="repeats along the wales")
    max_angle: float = number(40.0, "deg", "shear: largest shear angle", gt=0, le=60)
    end_angle: float | None = number(
        None, "deg", "shear: angle at which the run ends, on its way to max_angle as without it; none: there",
        gt=0, le=60,
    )  # fmt: skip
    max_strain: float = number(
        1.0, "%", "warp, weft, biaxial: largest mean strain; along a direction without inlays 40 unless stated",
        gt=0, le=300, band=(0.05, 300),
    )  # fmt: skip
    max_strain_fraction: ClassVar[Kernel[float]] = Kernel("max_strain")
    ratio: float = number(1.0, "1", "biaxial: mean strain of the weft over that of the warp", ge=0, le=10)
    transverse: Literal["free", "held"] = Field(
        "free", description="warp, weft: the other direction carries no mean stress, or keeps its mean length"
    )
    at_fracture: Literal["refused", "ends"] = Field(
        "refused", description="warp, weft, biaxial, steps: where a yarn comes to its fracture strain the path is "
        "refused, or ends",
    )  # fmt: skip
    max_force: float | None = number(
        None, "N/mm", "warp, weft, biaxial, steps: force per width, pull or push, along a direction without inlays at "
        "which the path ends; none: it does not", gt=0, le=1000,
    )  # fmt: skip
    bent_yarns: Literal["warp", "weft"] = Field("warp", description="bending: the yarns that are bent")
    max_curvature: float = number(0.05, "1/mm", "bending: largest mean curvature, hollow on the face", gt=0, le=0.3)
    max_pressure: float = number(1000.0, "kPa", "compaction: largest pressure of the plates", gt=0, le=10000)
    evaluated_from: float = number(
        2.5, "%", "share of the path from which results and quality checks begin; not used in bending", ge=0, le=25
    )
    evaluated_from_fraction: ClassVar[Kernel[float]] = Kernel("evaluated_from")
    max_slip: float = number(
        2.0, "1", "way that yarns may slide past each other before images of the cell are missing, over the largest "
        "radius", ge=0, le=20,
    )  # fmt: skip
    membrane_share: float = number(
        0.05, "1", "shear, bending, compaction: share of the yarns' axial stiffness that is kept: none is pulled, and "
        "the step grows", gt=0, le=1,
    )  # fmt: skip

    @model_validator(mode="before")
    @classmethod
    def _read(cls, data: Any) -> Any:
        """A file in place of a path is read here, so that a run folder holds its numbers."""
        if isinstance(data, Mapping) and str(data.get("path", "")).endswith(".csv"):
            return {**data, "path": "steps", "steps": read_steps(str(data["path"]))}
        return data

    @model_validator(mode="after")
    def _path_fits(self) -> Self:
        if (self.path == "steps") != bool(self.steps):
            raise BoundsError("can only be given by rig.path=FILE.csv", "steps")
        if self.end_angle is not None and self.path != "shear":
            raise BoundsError("can only be used with rig.path=shear", "end_angle")
        if self.end_angle is not None and self.end_angle > self.max_angle:
            raise BoundsError(f"must be at most max_angle, {self.max_angle:g} deg", "end_angle")
        return self

    @property
    def last_angle(self) -> float:
        """Shear angle [deg] at the end of the run."""
        return self.max_angle if self.end_angle is None else self.end_angle

    @property
    def axial_share(self) -> float:
        """Share of the axial stiffness that the yarns keep."""
        return 1.0 if self.path in TENSION_PATHS else self.membrane_share

    @property
    def about(self) -> str:
        """System that is bent, empty if none is."""
        return self.bent_yarns if self.path == "bending" else ""


#: directions that the paths stretch
PULLED: dict[str, tuple[str, ...]] = {
    "warp": ("warp",), "weft": ("weft",), "biaxial": ("warp", "weft"), "steps": ("warp", "weft"),
}  # fmt: skip
#: strain [%] of loops without inlays
KNIT_STRAIN = 40.0
#: speed [m/s] of 100 mm of fabric whose rows are relaxed: at it the kinetic energy is a small share of the work
RELAXED_SPEED = {"shear": 0.3, "bending": 0.05}
#: the same of yarns with a soft shell in bending, and along the other paths: 2, 4 and 20 times less give the same curve
SOFT_BENDING_SPEED, SOFT_SPEED = 0.4, 8.0


class CellRun(Run):
    """A cell test."""

    rig: CellRig = Field(default_factory=CellRig)

    @property
    def pulls_loops(self) -> bool:
        """See :class:`Run`."""
        return any(not self.fabric.inlays_along(direction) for direction in PULLED.get(self.rig.path, ()))

    @property
    def uses_tools(self) -> bool:
        """See :class:`Run`."""
        return self.rig.path == "compaction"

    @property
    def is_relaxed(self) -> bool:
        """Tell whether the cell is relaxed at each row: loops without inlays in a direction are so soft that otherwise
        inertia and damping decide.
        """
        return not self.fabric.has_inlays_both_ways and self.rig.path != "compaction"

    def structure_defaults(self) -> dict[tuple[str, str], float]:
        """Knits stretch by tens of per cent under small forces, along inlays they do not."""
        wanted = dict[tuple[str, str], float]()
        if self.is_relaxed:
            usual = SOFT_SPEED if self.fabric.has_soft_yarns else SPEED["warp"]
            wanted["solver", "speed"] = RELAXED_SPEED.get(self.rig.path, usual)
            if self.fabric.has_soft_yarns and self.rig.path == "bending":
                wanted["solver", "speed"] = SOFT_BENDING_SPEED
        if self.pulls_loops and self.rig.path != "steps" and not (self.rig.path == "biaxial" and self.fabric.inlays):
            wanted["rig", "max_strain"] = KNIT_STRAIN
        return wanted
