"""The cell of a fabric at rest by the contact law of the run: loops under tension, crossings that press.

Without edges it settles within a second, so what a draw-in means for any specimen is found here: the tension of the
loops, and whether they lock.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache

from knittest.base.errors import InputError
from knittest.base.rest import Rest
from knittest.config.base import Quantity
from knittest.config.run import Run
from knittest.fabric.relax import relaxed_cell
from knittest.models.at_rest import at_rest
from knittest.models.conforming import conforming
from knittest.models.crossings import Crossings
from knittest.models.meso_cell import build_meso_cell
from knittest.solve.periodic_body import PeriodicBody
from knittest.solve.settled_cache import remembered

#: forces out of balance over those of contacts at rest, most steps to it, and above which yarns have not found a rest
AT_REST, PATIENT, RESTLESS = 0.01, 20_000, 0.05
#: largest draw-in [-] that is looked at, and what it is found to; a tension is met to this share
LARGEST, NEAR, MET = 0.1, 5e-4, 1e-3
#: beams in a loop and in a wave of meshes that are looked at, and what contact forces may be off from those of the last
MESHES, COARSE = ((30, 8), (48, 12), (64, 16)), 0.2


@dataclass(frozen=True)
class SettledCell:
    """A cell at ``rest`` whose loops are drawn in by ``draw_in`` [-]: steps to there, its crossings by kind, why
    contacts could not follow its sections (empty where they do), and how deep yarns sink into each other over a radius
    [-], their ``depth``.
    """

    draw_in: float
    rest: Rest
    steps: int
    crossings: dict[str, Crossings]
    conforming: str
    depth: float

    @property
    def tension(self) -> float:
        """Mean axial force in the loops' yarn [N]."""
        return self.rest.tension

    @property
    def residual(self) -> float:
        """Forces out of balance over those of contacts [-]."""
        return self.rest.residual

    @property
    def pressing(self) -> float:
        """Sum of the contact forces [N]."""
        return sum(c.count * c.normal_force for c in self.crossings.values())


def settled_cell(run: Run, axial_share: float = 1.0) -> SettledCell:
    """The cell at the stated draw-in, or at the one that gives the stated tension.

    Raises :class:`InputError` where the loops lock, with the largest number that would do, for a tension below that of
    loops of their measured length, and for sections along which the loops bend at that rest.
    """

    @cache
    def at(draw_in: float) -> SettledCell:
        return settle_at(run, draw_in, axial_share)

    found = _as_stated(run, at)
    if found.conforming:
        raise InputError(found.conforming)
    return found


def _as_stated(run: Run, at: Callable[[float], SettledCell]) -> SettledCell:
    knitting = run.fabric.knitting
    if knitting.tension_n is not None:
        return _at_tension(run, at, knitting.tension_n)
    draw_in = knitting.draw_in_fraction or 0.0
    if not at(draw_in).conforming and (why := _locks(run, at(draw_in))):
        least = 100.0 * _largest(run, at, draw_in)
        raise InputError(
            f"fabric.knitting.draw_in = {100.0 * draw_in:g} %: the loops lock, {why}; expected at most {least:.3g} %"
        )
    return at(draw_in)


def with_draw_in(run: Run, axial_share: float = 1.0) -> Run:
    """Turn a tension of the loops into the draw-in of the settled cell; ``run`` as it is where none is stated.

    Raises :class:`InputError` where the loops lock, and for a tension of yarns that do not touch.
    """
    if not _settles(run):
        return run
    if not run.model.meso.contact:
        raise InputError(
            "model.meso.contact = false: loops under fabric.knitting.draw_in or tension need crossings that hold them"
        )
    return _drawn_in(run, settled_cell(run, axial_share).draw_in)


def too_coarse(run: Run, axial_share: float = 1.0) -> str:
    """Reason why the mesh of ``run`` cannot settle its fabric, with one that can; empty if it can or none is settled.

    On coarse meshes yarns overlap that do not on fine ones, and press where all overlaps do.
    """
    if not _settles(run):
        return ""
    drawn = with_draw_in(run, axial_share)
    draw_in = drawn.fabric.knitting.draw_in_fraction or 0.0

    @cache
    def pressing(mesh: tuple[int, int]) -> float:
        return settle_at(_on_mesh(run, mesh), draw_in, axial_share).pressing

    own, fine = settle_at(run, draw_in, axial_share).pressing, pressing(MESHES[-1])
    if abs(own / fine - 1.0) <= COARSE:
        return ""
    loop, wave = next(mesh for mesh in MESHES if abs(pressing(mesh) / fine - 1.0) <= COARSE)
    return (
        f"contact forces of the settled cell are {own / fine:.2g} times those on a fine mesh, {1.0 - COARSE:g} to "
        f"{1.0 + COARSE:g} are allowed: model.meso.elements_per_loop={loop} with elements_per_wave={wave} would pass"
    )


def settle_at(run: Run, draw_in: float, axial_share: float = 1.0) -> SettledCell:
    """The cell of ``run`` at rest with loops drawn in by ``draw_in`` [-], whatever the fabric states (cached)."""
    what = {"draw_in": draw_in, "axial_share": axial_share}
    found = remembered(_drawn_in(run, draw_in), what, lambda: asdict(_settle_at(run, draw_in, axial_share)))
    crossings = {kind: Crossings(**of) for kind, of in found["crossings"].items()}
    return SettledCell(**found | {"rest": Rest(**found["rest"]), "crossings": crossings})


def _settle_at(run: Run, draw_in: float, axial_share: float) -> SettledCell:
    model = build_meso_cell(_drawn_in(run, draw_in), relaxed_cell(run.fabric), 1, 1, axial_share=axial_share)
    body = PeriodicBody(model, run.solver.safety)
    found = body.settle(AT_REST, PATIENT)
    rest = at_rest(model, found.residual)
    assert rest is not None
    told = conforming(model.tracker, model.nodes.position)
    depth = float(model.stored().penetration.max(initial=0.0))
    return SettledCell(draw_in, rest, found.steps, body.crossings(), told, depth)


def _settles(run: Run) -> bool:
    return run.model.scale == "meso" and run.model.meso.knitting and run.fabric.knitting.settled


def _on_mesh(run: Run, mesh: tuple[int, int]) -> Run:
    """``run`` on a mesh of other numbers of beams in a loop and in a wave."""
    meso = run.model.meso.model_copy(update={"elements_per_loop": mesh[0], "elements_per_wave": mesh[1]})
    return run.model_copy(update={"model": run.model.model_copy(update={"meso": meso})})


def _drawn_in(run: Run, draw_in: float) -> Run:
    """``run`` whose loops are drawn in by ``draw_in`` [-]."""
    drawn = Quantity(value=100.0 * draw_in, source="derived", ref="the settled cell")
    knitting = run.fabric.knitting.model_copy(update={"draw_in": drawn, "tension": None})
    return run.model_copy(update={"fabric": run.fabric.model_copy(update={"knitting": knitting})})


def _at_tension(run: Run, at: Callable[[float], SettledCell], wanted: float) -> SettledCell:
    from scipy.optimize import brentq

    slack = at(0.0)
    if wanted < slack.tension:
        raise InputError(
            f"fabric.knitting.tension = {wanted:g} N: loops of their measured length are under {slack.tension:.3g} N; "
            f"expected at least {slack.tension:.3g} N"
        )
    locks = _locks(run, at(LARGEST))
    most = _largest(run, at, LARGEST) if locks else LARGEST
    if wanted > at(most).tension:
        why = "the loops lock before" if locks else "the loops would be drawn in further than is looked at"
        raise InputError(
            f"fabric.knitting.tension = {wanted:g} N: {why}, {100.0 * most:.3g} %; expected at most "
            f"{at(most).tension:.3g} N"
        )
    return at(float(brentq(lambda p: at(p).tension - wanted, 0.0, most, xtol=1e-7, rtol=MET)))


def _locks(run: Run, found: SettledCell) -> str:
    """Reason to call the loops locked: nothing comes to rest, or yarns sink in as no run may; empty if neither."""
    if found.residual > RESTLESS:
        return f"nothing comes to rest (forces out of balance {100.0 * found.residual:.0f} % of those of contacts)"
    if 100.0 * found.depth > run.solver.max_penetration:
        return f"yarns sink into each other by {100.0 * found.depth:.0f} % of a radius"
    return ""


def _largest(run: Run, at: Callable[[float], SettledCell], locked: float) -> float:
    """Largest draw-in below ``locked`` at which the loops do not lock, by bisection."""
    low = 0.0
    while locked - low > NEAR:
        middle = 0.5 * (low + locked)
        low, locked = (low, middle) if _locks(run, at(middle)) else (middle, locked)
    return low
