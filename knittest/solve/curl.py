"""Curl of fabric that nothing keeps flat: moment of the flat cell over its bending stiffness.

Loops that are not fully set, or under tension on one side of the inlays, press towards one face. A cell held flat bears
the moment M per length; let go it bends by kappa until M + D kappa = 0, with the bending stiffness D of the same cell.
Each direction is taken by itself, the other one flat: a piece cannot curl both ways at once.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass

from numpy.typing import ArrayLike

from knittest.config.run import Run
from knittest.fabric.relax import relaxed_cell
from knittest.models.meso_cell import build_meso_cell, lattice_of
from knittest.models.table import Table, ramp
from knittest.solve.periodic_body import PeriodicBody
from knittest.solve.settled_cache import remembered

#: curvature [1/mm] to which the stiffness is the secant, and time to there [ms]
PROBE, WAY = 0.01, 10.0
#: forces out of balance over those of contacts at rest, and most steps to it
AT_REST, PATIENT = 2e-3, 10_000


@dataclass(frozen=True)
class Curl:
    """Moment per length [N] that keeps a cell flat, and its bending stiffness per length [N mm]."""

    moment: float
    stiffness: float

    @property
    def curvature(self) -> float:
        """Curvature [1/mm] of the free fabric, positive where it is hollow towards its face (+z)."""
        return -self.moment / self.stiffness


def curl_of(cell: Callable[[], PeriodicBody], along: ArrayLike) -> Curl:
    """Curl along ``along`` (3,) of the ``cell``, a new one a call: at rest flat, and bent by :data:`PROBE`.

    It is bent the way it curls: crossings that stick resist the other way more.
    """
    held = cell()
    held.settle(AT_REST, PATIENT)
    body = cell()
    body.bend(_there(-PROBE if held.bending_moment() > 0.0 else PROBE), along)
    body.settle(AT_REST, PATIENT)
    flat = body.bending_moment()
    body.advance(WAY)
    body.settle(AT_REST, PATIENT)
    return Curl(flat, (body.bending_moment() - flat) / body.cell.curvature)


def cell_curl(run: Run, axial_share: float = 1.0) -> dict[str, Curl]:
    """Curl of the cell of ``run``, at the draw-in that its fabric states, along its courses (weft) and wales (warp).

    Bent inlays lie about the surface that keeps its length: their tension bears no moment.
    """
    found = remembered(
        run, {"curl": [PROBE, WAY, AT_REST, PATIENT], "axial_share": axial_share},
        lambda: {system: asdict(_curl_along(run, system, axial_share)) for system in ("weft", "warp")},
    )  # fmt: skip
    return {system: Curl(**numbers) for system, numbers in found.items()}


def _curl_along(run: Run, system: str, axial_share: float) -> Curl:
    """Curl of the cell in which the inlays ``system`` bend."""
    cell = relaxed_cell(run.fabric)

    def new() -> PeriodicBody:
        model = build_meso_cell(run, cell, 1, 1, axial_share=axial_share, about=system)
        model.bend_along(along)
        return PeriodicBody(model, run.solver.safety, threads=1)

    along = lattice_of(cell, 1, 1)[0 if system == "weft" else 1]
    return curl_of(new, along)


def _there(curvature: float) -> Table:
    """Rate [1/(mm ms)] that bends by ``curvature`` within :data:`WAY`, from rest to rest."""
    up = ramp(0.25 * WAY, curvature / (0.75 * WAY))
    down = tuple(WAY - t for t in reversed(up.time))
    return Table((*up.time, *down), (*up.value, *reversed(up.value)))
