"""Reads exports of bias extension tests: force of the clamp over its travel."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment import lab_units
from knittest.experiment.lab_conditions import GAUGE, WIDTH, agreed, stated, unstated
from knittest.experiment.lab_given import Given
from knittest.experiment.lab_shear import Tested, pairs, shear_curve, specimens_in
from knittest.experiment.lab_table import read_table
from knittest.laboratory.bias_extension.pin_jointed import BiasStrip

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pulled:
    """Shear angle of pin-jointed yarns [deg], rising, and force [N] of one specimen on its first loading, (n,) each.

    ``turned`` says that more loading follows, which is left out; ``unit`` is that of the file's forces.
    """

    name: str
    angle: Array
    force: Array
    strip: BiasStrip
    path: Path
    turned: bool
    unit: str = "N"

    @property
    def normalised(self) -> Array:
        """Normalised shear force [N/mm], (n,)."""
        return self.strip.normalised(self.force, np.deg2rad(self.angle))


def read_strips(path: Path, given: Given) -> list[Pulled]:
    """Specimens in one export, told apart by repeated pairs of columns of travel and force.

    The travel of the clamp becomes the angle by the strip's length and width; an angle that was measured is another
    one, and not read. Raises :class:`InputError` where the size is not known or too short, and as
    :func:`knittest.experiment.lab_shear.shear_curve`.
    """
    table = read_table(
        path, lambda cells: bool(pairs(cells, angles=False)), "a force and a displacement of the clamp", given.decimal,
        given.delimiter,
    )  # fmt: skip
    length, width = (
        agreed(size, given.sizes.get(size.key), stated(size, path, table.head, table.mark)) for size in (GAUGE, WIDTH)
    )
    if length is None or width is None:
        raise unstated([w for w, value in ((GAUGE, length), (WIDTH, width)) if value is None], path)
    try:
        strip = BiasStrip(length, width)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    tested = Tested(
        "bias-extension", strip, f"a strip {width:g} mm wide, {length:g} mm between the clamps,",
        "the strip not yet sheared", f"{GAUGE.option}, {WIDTH.option}",
    )  # fmt: skip
    columns, found = specimens_in(table, angles=False), []
    for number, pair in enumerate(columns, 1):
        name = path.stem if len(columns) == 1 else f"{path.stem}-{number}"
        curve = shear_curve(table, name, pair, tested, given)
        unit = lab_units.force_unit(table.names[pair[1]], table.units[pair[1]], table.where)
        found.append(Pulled(name, curve.angle, curve.force, strip, path, curve.turned, unit))
    return found
