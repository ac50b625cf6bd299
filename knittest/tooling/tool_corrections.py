"""Changes of files that make tools fit: rotation, place, stamp and die swapped, unit."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain, combinations, product

import numpy as np
from scipy.spatial.transform import Rotation

from knittest.base.errors import InputError
from knittest.config.tools import StlTool
from knittest.tooling.fit import Stroke, filled_share, measure_fit
from knittest.tooling.stl_tool import CELLS
from knittest.tooling.toolset import RigidTool, ToolSet

Degrees = tuple[float, float, float]

#: finest grid [mm] on which candidates are sampled at first, and cells of their height maps
COARSE, FEW_CELLS = 3.0, 60
#: other units of a file: metres, inches, centimetres and their inverses
SCALES = (1000.0, 25.4, 10.0, 0.1, 1.0 / 25.4, 0.001)
#: smallest distance [mm] of the middle of a file from that of the blank that is worth a change
OFF_CENTRE = 0.5


@dataclass(frozen=True)
class Change:
    """Fields of the files to change, by name of the tool, so that the tools fit."""

    fields: dict[str, dict[str, object]]

    @property
    def settings(self) -> list[str]:
        """Settings of a run, ``rig.NAME.stl.FIELD=VALUE``."""
        return [
            f"rig.{name}.stl.{field}={_setting_text(value)}"
            for name, fields in self.fields.items()
            for field, value in fields.items()
        ]


def axis_rotations() -> list[Degrees]:
    """Return the 24 rotations of axes into axes, as angles about x, y and z [deg]; those about x alone first."""
    found: dict[bytes, Degrees] = {}
    angles = sorted(
        product((0.0, 90.0, -90.0, 180.0), repeat=3),
        key=lambda a: (np.count_nonzero(a), np.abs(a).sum(), abs(a[2]), abs(a[1])),
    )
    for x, y, z in angles:
        matrix = np.round(Rotation.from_euler("xyz", (x, y, z), degrees=True).as_matrix()).astype(np.int8)
        found.setdefault(matrix.tobytes(), (x, y, z))
    return list(found.values())


def fitting_change(tools: ToolSet, stroke: Stroke) -> Change | None:
    """Find the smallest change of files with which ``tools`` fit; None if there is none.

    Candidates: files moved to the middle of the blank; stamp and die swapped; rotations of one, two and all tools,
    starting with those that fill the die's opening best; other units; rotations of centred tools. Each is tried on a
    coarse grid first.
    """
    search = _CorrectionSearch(tools, stroke)
    groups = chain(
        [search.centre_tools(), search.swap_stamp_and_die()], search.rotate_tools(), [search.change_units()],
        ([c for change in group for c in search.move_to_middle(change)] for group in search.rotate_tools()),
    )  # fmt: skip
    ranked = (change for group in groups for change in search.sort_by_filled_share(list(group)))
    return next((change for change in ranked if search.fits(change, COARSE) and search.fits(change, 0.0)), None)


class _CorrectionSearch:
    """Candidates for the files of ``tools``, each tool made only once."""

    def __init__(self, tools: ToolSet, stroke: Stroke) -> None:
        self.tools, self.stroke = tools, stroke
        self.files = {name: tool.stl for name, tool in tools.by_name.items() if tool.stl is not None}
        self.known: dict[tuple[str, StlTool], RigidTool | None] = {}

    def rotate_tools(self) -> Iterator[list[Change]]:
        """Rotations of one tool, then of two, then of three."""
        stated = {name: stl.rotation or (0.0, 0.0, 0.0) for name, stl in self.files.items()}
        for size in range(1, len(self.files) + 1):
            yield [
                Change({name: {"rotation": rotation} for name in names})
                for names in combinations(self.files, size)
                for rotation in axis_rotations()
                if all(rotation != stated[name] for name in names)
            ]

    def sort_by_filled_share(self, changes: list[Change]) -> list[Change]:
        """Sort the ``changes`` that height maps allow by the share of the filled opening."""
        filled = [(self._share_filled(change, FEW_CELLS), change) for change in changes]
        return [change for share, change in sorted(filled, key=lambda pair: -round(pair[0], 1)) if share > 0.0]

    def centre_tools(self) -> Iterator[Change]:
        away = {name: self._offset_to_middle(self.tools.by_name[name]) for name in self.files}
        for names in self._groups_of_files():
            if all(away[name] for name in names):
                yield Change({name: away[name] for name in names})

    def move_to_middle(self, change: Change) -> Iterator[Change]:
        """Yield the ``change`` with its tools moved to the middle of the blank, if they are elsewhere."""
        made = self._make_set(change, COARSE)
        away = {} if made is None else {name: self._offset_to_middle(made.by_name[name]) for name in change.fields}
        if any(away.values()):
            yield Change({name: {**fields, **away[name]} for name, fields in change.fields.items()})

    def _offset_to_middle(self, tool: RigidTool) -> dict[str, object]:
        """Fields that move ``tool`` to the middle of the blank; none if it is there."""
        assert tool.stl is not None
        points = tool.solid.points[:, :2]
        x, y = (float(value) for value in -0.5 * (points.min(axis=0) + points.max(axis=0)))
        if max(abs(x), abs(y)) <= OFF_CENTRE:
            return {}
        # no negative zero
        return {"offset_x": round(tool.stl.offset_x + x, 2) + 0.0, "offset_y": round(tool.stl.offset_y + y, 2) + 0.0}

    def swap_stamp_and_die(self) -> Iterator[Change]:
        if {"stamp", "die"} <= set(self.files):
            yield Change({"stamp": {"path": self.files["die"].path}, "die": {"path": self.files["stamp"].path}})

    def change_units(self) -> Iterator[Change]:
        for names in reversed(self._groups_of_files()):
            for scale in SCALES:
                yield Change({name: {"scale": self.files[name].scale * scale} for name in names})

    def fits(self, change: Change, coarsest: float) -> bool:
        """Return whether the tools fit with ``change``, on a grid of ``coarsest`` [mm] or the file's, if coarser."""
        try:
            tools = self._make_set(change, coarsest)
            return (
                tools is not None
                and self._share_filled(change, CELLS) > 0.0
                and not measure_fit(tools, self.stroke).problems
            )
        except InputError:  # a body that cannot be sampled as it lies
            return False

    def _share_filled(self, change: Change, cells: int) -> float:
        tools = self._make_set(change, COARSE)
        return 0.0 if tools is None else filled_share(tools, self.stroke, cells)

    def _groups_of_files(self) -> list[tuple[str, ...]]:
        sizes = range(1, len(self.files) + 1)
        return [group for size in sizes for group in combinations(self.files, size)]

    def _make_set(self, change: Change, coarsest: float) -> ToolSet | None:
        made = {}
        for name, fields in change.fields.items():
            spacing = max(self.files[name].spacing, coarsest)
            stl = self.files[name].model_copy(update={**fields, "spacing": spacing})
            if (name, stl) not in self.known:
                self.known[name, stl] = None
                with suppress(InputError):
                    self.known[name, stl] = self.tools.by_name[name].with_fields(**stl.model_dump())
            if (tool := self.known[name, stl]) is None:
                return None
            made[name] = tool
        return replace(self.tools, **made)


def _setting_text(value: object) -> str:
    if isinstance(value, tuple):
        return "[" + ",".join(f"{float(part):g}" for part in value) + "]"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
