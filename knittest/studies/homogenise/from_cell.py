"""A periodic cell of yarns in place of tests of yarns: a path for each number of the card, and shells to check it."""

from collections.abc import Sequence
from math import floor
from pathlib import Path

from knittest.base.errors import InputError
from knittest.config.fabric import Direction
from knittest.config.run import Run
from knittest.config.settings import Setting
from knittest.laboratory.cantilever.config import CantileverRun
from knittest.studies.homogenise.plan import (
    LONGER,
    Piece,
    Request,
    hanging,
    on_shells,
    own,
    resolved,
    settings_for,
    width,
)

#: strain that tensile paths go to over that at which straight yarns are torn
BEYOND = 1.05
#: angle [deg] of the sheared cell: the last whole step of the law lies beyond 40 deg
ANGLE = 42.5


def cell_run(request: Request, piece: Piece) -> Run:
    """The path of a cell that tells what ``piece`` tells of yarns; raises :class:`InputError` for what the schema
    refuses, and for settings that would make another path of it.
    """
    sets, fixed = settings_for(request.sets, piece), _path(piece)
    for setting in sets:
        if (name := ".".join(map(str, setting.path))) in fixed:
            raise InputError(f"{setting.said}: {piece.name} of a cell needs {name} = {fixed[name]}: leave it out")
    settings = [own(name, value) for name, value in fixed.items()]
    run = resolved(request, "cell", None, [*settings, *sets])
    if run.variability.specimens > 1:
        raise InputError("variability.specimens: yarns of a cell are all alike: leave it at 1")
    usual = _usual(piece, run)
    return resolved(request, "cell", None, [*settings, *usual, *sets])


def cell_shell_run(piece: Piece, yarns: Run, card: Path, last_angle: float, stiffness: dict[Direction, float]) -> Run:
    """The run of ``piece`` on shells of the usual size, a strip as wide as its whole yarns, which hangs as its
    ``stiffness`` [N mm] by direction says.

    A frame is sheared to ``last_angle`` [deg], where its law ends.
    """
    if piece.kind == "picture-frame":
        return on_shells(piece, yarns, card, [own("rig.max_angle", floor(10.0 * last_angle) / 10.0)])
    whole = own("rig.width", width(on_shells(piece, yarns, card, [])))
    run = on_shells(piece, yarns, card, [whole])
    if not isinstance(run, CantileverRun) or piece.direction is None:
        return run
    overhang = round(hanging(stiffness[piece.direction], run), 1)
    length = max(run.rig.length, round(LONGER * overhang, 1))
    more = [whole, own("rig.mode", "angle"), own("rig.overhang", overhang), own("rig.length", length)]
    return on_shells(piece, yarns, card, more)


def _path(piece: Piece) -> dict[str, object]:
    """Fields that make a path that of ``piece``."""
    if piece.kind == "tensile":
        return {"rig.path": piece.direction, "rig.torn": "ends"}
    if piece.kind == "cantilever":
        return {"rig.path": "bending", "rig.bent": piece.direction}
    return {"rig.path": "shear"}


def _usual(piece: Piece, run: Run) -> Sequence[Setting]:
    """End of ``piece`` unless one is said: yarns are torn, and the shear law comes beyond 40 deg."""
    if piece.kind == "tensile":
        yarn = run.fabric.reinforcing
        most = (1.0 + yarn.crimp_fraction.of(str(piece.direction))) * (1.0 + yarn.fracture_strain_fraction) - 1.0
        return [own("rig.max_strain", round(100.0 * BEYOND * most, 4))]
    return [own("rig.max_angle", ANGLE)] if piece.kind == "picture-frame" else []
