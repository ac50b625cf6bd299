"""End of a cell's path: of shear, which is read at places on its way."""

from knittest.laboratory.cell.config import CellRun
from knittest.laboratory.ending import Ending

#: shear angles at which results are read [deg], and half the range over which they are averaged
ANGLES, NEAR = (1.0, 10.0, 20.0, 30.0, 40.0), 0.5


def ending(run: CellRun) -> Ending | None:
    """End of the path of ``run``; None where all that is read of it is read at its end."""
    return Ending("rig.end_angle", run.rig.last_angle, NEAR) if run.rig.path == "shear" else None
