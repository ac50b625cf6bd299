"""The relaxed cell of a fabric under the contact law of the run: loops under tension, locking, curl; cached on disk.

Without edges it settles within a second, so what a draw-in means for any specimen is found here: the tension of the
loops, and whether they lock.
"""

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from knittest.base.cache import Damaged, cache_folder, load_cached, save_cached
from knittest.base.errors import InputError
from knittest.base.history import InitialEquilibrium
from knittest.base.progress import tell
from knittest.config.base import Quantity
from knittest.config.fabric import Fabric
from knittest.config.run import RUNS, Run
from knittest.fabric.cell import CellSpec
from knittest.fabric.relaxation import densities, keep_cell, relaxed_cell, settled_cell, start_of_relaxation
from knittest.models.crossings import Crossings, initial_equilibrium
from knittest.models.meso import build_meso_cell, lattice_of
from knittest.models.natural_state import conformity_fault
from knittest.models.tool import Table, ramp
from knittest.solve.periodic_body import PeriodicBody

# Settled cells on disk, keyed by all that enters them: the fabric, the mesh, the step, and every source that shapes or
# moves yarns.

#: rooms whose sources decide how a cell relaxes
ROOMS = ("base", "config", "fabric", "kernels", "materials", "models", "solve")
DIGITS = 24

Numbers = dict[str, Any]


def load_or_compute(run: Run, what: Numbers, compute: Callable[[], Numbers]) -> Numbers:
    """Plain numbers of the settled cell of ``run`` under the conditions ``what``: those kept, or computed and kept."""
    key = relaxed_cell_key(run, what)
    folder = cache_folder("settled")
    path = None if folder is None else folder / f"{key}.npz"
    try:
        arrays = load_cached(path, key)
        if arrays is not None:
            return json.loads(str(arrays["numbers"]))
    except (Damaged, KeyError, ValueError) as error:
        tell(f"{path}: {error}; the cached relaxed cell is computed again")
    text = json.dumps(compute())
    save_cached(path, key, {"numbers": np.array(text)})
    return json.loads(text)


def relaxed_cell_key(run: Run, what: Numbers) -> str:
    """Digest of the fabric, mesh and step of ``run``, of ``what``, and of the sources."""
    entering = {
        "fabric": run.fabric.model_dump(mode="json"),
        "meso": run.model.meso.model_dump(mode="json"),
        "solver": run.solver.model_dump(mode="json", include={"safety", "target_step", "max_added_mass"}),
        "what": what,
    }
    digest = hashlib.sha256(json.dumps(entering, sort_keys=True).encode())
    digest.update(_sources().encode())
    return digest.hexdigest()[:DIGITS]


@cache
def _sources() -> str:
    """Digest of all sources in :data:`ROOMS`, as this process found them first."""
    package = Path(__file__).parent.parent
    digest = hashlib.sha256()
    for room in ROOMS:
        for source in sorted((package / room).glob("*.py")):
            digest.update(f"{room}/{source.name}".encode() + source.read_bytes())
    return digest.hexdigest()


#: residual forces over those of contacts in equilibrium, most steps to it, and the residual that is none
AT_REST, PATIENT, RESTLESS = 0.01, 20_000, 0.05
#: largest draw-in [-] that is looked at, and what it is found to; a tension is met to this share
LARGEST, NEAR, MET = 0.1, 5e-4, 1e-3
#: beams in a loop and in a wave of meshes that are looked at, and what contact forces may be off from those of the last
MESHES, COARSE = ((30, 8), (48, 12), (64, 16)), 0.2


@dataclass(frozen=True)
class RelaxedCell:
    """A cell at ``rest`` whose loops are drawn in by ``draw_in`` [-]: steps to there, its crossings by kind, why
    contacts could not follow its sections (empty where they do), and the ``depth`` of penetration over a radius [-].
    """

    draw_in: float
    rest: InitialEquilibrium
    steps: int
    crossings: dict[str, Crossings]
    conformity_fault: str
    depth: float

    @property
    def tension(self) -> float:
        """Mean axial force in the loops' yarn [N]."""
        return self.rest.tension

    @property
    def residual(self) -> float:
        """Residual forces over those of contacts [-]."""
        return self.rest.residual

    @property
    def contact_force_sum(self) -> float:
        """Sum of the contact forces [N]."""
        return sum(c.count * c.normal_force for c in self.crossings.values())


def relaxed_contact_cell(run: Run, axial_share: float = 1.0) -> RelaxedCell:
    """The cell at the stated draw-in, or at the one that gives the stated tension.

    Raises :class:`InputError` where the loops lock, with the largest number that would do, for a tension below that of
    loops of their measured length, and for sections along which the loops bend at that rest.
    """

    @cache
    def at(draw_in: float) -> RelaxedCell:
        return relax_at_shortening(run, draw_in, axial_share)

    found = _cell_as_stated(run, at)
    if found.conformity_fault:
        raise InputError(found.conformity_fault)
    return found


def _cell_as_stated(run: Run, at: Callable[[float], RelaxedCell]) -> RelaxedCell:
    knitting = run.fabric.knitting
    if knitting.tension_n is not None:
        return _cell_at_tension(run, at, knitting.tension_n)
    draw_in = knitting.loop_shortening_fraction or 0.0
    if not at(draw_in).conformity_fault and (why := _locking_reason(run, at(draw_in))):
        if first := _locking_reason(run, at(0.0)):
            raise InputError(
                f"fabric.loop_length = {run.fabric.loop_length_mm:g} mm: {first}, even without loop shortening; "
                "change fabric.loop_length, warp_density or weft_density"
            )
        least = 100.0 * _largest_shortening(run, at, draw_in)
        raise InputError(
            f"fabric.knitting.loop_shortening = {100.0 * draw_in:g} %: the loops lock: {why}; expected at "
            f"most {least:.3g} %"
        )
    return at(draw_in)


def with_loop_shortening(run: Run, axial_share: float = 1.0) -> Run:
    """Turn a tension of the loops into the draw-in of the settled cell; ``run`` as it is where none is stated.

    Raises :class:`InputError` where the loops lock, and for a tension of yarns that do not touch.
    """
    if not _relaxes_under_contact(run):
        return run
    if not run.model.meso.contact:
        raise InputError(
            "model.meso.contact = false: fabric.knitting.loop_shortening and tension need yarn contact; set it to true"
        )
    return _with_shortening(run, relaxed_contact_cell(run, axial_share).draw_in)


def mesh_fault(run: Run, axial_share: float = 1.0) -> str:
    """Reason why the mesh of ``run`` cannot settle its fabric, with one that can; empty if it can or none is settled.

    On coarse meshes yarns overlap that do not on fine ones, and press where all overlaps do.
    """
    if not _relaxes_under_contact(run):
        return ""
    drawn = with_loop_shortening(run, axial_share)
    draw_in = drawn.fabric.knitting.loop_shortening_fraction or 0.0

    @cache
    def pressing(mesh: tuple[int, int]) -> float:
        return relax_at_shortening(_with_mesh(run, mesh), draw_in, axial_share).contact_force_sum

    own, fine = relax_at_shortening(run, draw_in, axial_share).contact_force_sum, pressing(MESHES[-1])
    if abs(own / fine - 1.0) <= COARSE:
        return ""
    loop, wave = next(mesh for mesh in MESHES if abs(pressing(mesh) / fine - 1.0) <= COARSE)
    return (
        f"contact forces of the relaxed cell are {own / fine:.2g} times those on a fine mesh (allowed {1.0 - COARSE:g} "
        f"to {1.0 + COARSE:g}); set model.meso.elements_per_loop={loop} and elements_per_wave={wave}"
    )


def relax_at_shortening(run: Run, draw_in: float, axial_share: float = 1.0) -> RelaxedCell:
    """The cell of ``run`` at rest with loops drawn in by ``draw_in`` [-], whatever the fabric states (cached)."""
    what = {"draw_in": draw_in, "axial_share": axial_share}
    found = load_or_compute(
        _with_shortening(run, draw_in), what, lambda: asdict(_relax_at_shortening(run, draw_in, axial_share))
    )
    crossings = {kind: Crossings(**of) for kind, of in found["crossings"].items()}
    return RelaxedCell(**found | {"rest": InitialEquilibrium(**found["rest"]), "crossings": crossings})


def _relax_at_shortening(run: Run, draw_in: float, axial_share: float) -> RelaxedCell:
    model = build_meso_cell(_with_shortening(run, draw_in), relaxed_cell(run.fabric), 1, 1, axial_share=axial_share)
    body = PeriodicBody(model, run.solver.safety)
    found = body.settle(AT_REST, PATIENT)
    rest = initial_equilibrium(model, found.residual)
    assert rest is not None
    fault = conformity_fault(model.tracker, model.nodes.position)
    depth = float(model.stored_energies().penetration.max(initial=0.0))
    return RelaxedCell(draw_in, rest, found.steps, body.crossings(), fault, depth)


def _relaxes_under_contact(run: Run) -> bool:
    return run.model.scale == "meso" and run.model.meso.knitting and run.fabric.knitting.starts_relaxed


def _with_mesh(run: Run, mesh: tuple[int, int]) -> Run:
    meso = run.model.meso.model_copy(update={"elements_per_loop": mesh[0], "elements_per_wave": mesh[1]})
    return run.model_copy(update={"model": run.model.model_copy(update={"meso": meso})})


def _with_shortening(run: Run, draw_in: float) -> Run:
    drawn = Quantity(value=100.0 * draw_in, source="derived", ref="the settled cell")
    knitting = run.fabric.knitting.model_copy(update={"loop_shortening": drawn, "tension": None})
    return run.model_copy(update={"fabric": run.fabric.model_copy(update={"knitting": knitting})})


def _cell_at_tension(run: Run, at: Callable[[float], RelaxedCell], wanted: float) -> RelaxedCell:
    from scipy.optimize import brentq

    slack = at(0.0)
    if wanted < slack.tension:
        raise InputError(
            f"fabric.knitting.tension = {wanted:g} N: loops of their measured length already carry "
            f"{slack.tension:.3g} N; expected at least {slack.tension:.3g} N"
        )
    locks = _locking_reason(run, at(LARGEST))
    most = _largest_shortening(run, at, LARGEST) if locks else LARGEST
    if wanted > at(most).tension:
        why = "the loops lock at a loop shortening of" if locks else "the loop shortening would exceed"
        raise InputError(
            f"fabric.knitting.tension = {wanted:g} N: {why} {100.0 * most:.3g} %; expected at most "
            f"{at(most).tension:.3g} N"
        )
    return at(float(brentq(lambda p: at(p).tension - wanted, 0.0, most, xtol=1e-7, rtol=MET)))


def _locking_reason(run: Run, found: RelaxedCell) -> str:
    """Reason to call the loops locked: no equilibrium, or a penetration that no run may have; empty if neither."""
    if found.residual > RESTLESS:
        imbalance = f"residual contact-force imbalance {100.0 * found.residual:.0f} %"
        return f"no equilibrium is found ({imbalance}, limit {100.0 * RESTLESS:g} %)"
    if 100.0 * found.depth > run.solver.max_penetration:
        limit = run.solver.max_penetration
        return f"yarns penetrate each other by {100.0 * found.depth:.0f} % of the yarn radius (limit {limit:g} %)"
    return ""


def _largest_shortening(run: Run, at: Callable[[float], RelaxedCell], locked: float) -> float:
    """Largest draw-in below ``locked`` at which the loops do not lock, by bisection."""
    low = 0.0
    while locked - low > NEAR:
        middle = 0.5 * (low + locked)
        low, locked = (low, middle) if _locking_reason(run, at(middle)) else (middle, locked)
    return low


# Relaxed fabric of soft yarns: the spacings of its loops follow from the yarn and its length in a loop.

#: residual forces over those of contacts in equilibrium, most steps to it, and calls until then at most
FREE_AT_REST, FREE_PATIENT, CALLS = 1e-4, 20_000, 6
#: residual up to which the fabric is at rest nevertheless: slack loops creep
FREE_RESTLESS = 1e-3
#: origin of relaxed spacings
RELAXED = "relaxed fabric"
#: length of beams over the diameter of the core that is refused, and one that is fine: straight yarns that cross press
#: each other by the closed form within 10 % at 0.55
COARSEST, FINE = 0.95, 0.5


def with_rest_spacing(run: Run) -> Run:
    """``run`` with the spacings of wales and courses that loops of soft yarns take when nothing holds them.

    The stated spacings only say where the relaxation starts. The fabric relaxes without friction, as one that was
    worked or washed. Raises :class:`InputError` where no equilibrium is found.
    """
    if run.model.scale != "meso" or not run.fabric.has_soft_yarns or run.fabric.warp_density.ref == RELAXED:
        return run
    _check_soft_run(run)
    found = load_or_compute(run, {"free": [FREE_AT_REST, FREE_PATIENT, CALLS]}, lambda: _relax_freely(run))
    fabric, (across, along) = run.fabric, CellSpec.of(run.fabric).repeat
    spacing = {"warp_density": found["size"][0] / across, "weft_density": found["size"][1] / along}
    fabric = fabric.model_copy(update=densities(spacing, RELAXED))
    keep_cell(settled_cell(fabric, [np.array(points) for points in found["points"]]))
    return run.model_copy(update={"fabric": fabric})


def relaxed_fabric(fabric: Fabric) -> Fabric:
    """``fabric`` with the spacings of :func:`with_rest_spacing` at the usual mesh; unchanged without soft yarns."""
    if not fabric.has_yarns or not fabric.has_soft_yarns:
        return fabric
    run = RUNS["cell"].model_validate({"fabric": fabric, "rig": {"kind": "cell"}, "model": {"scale": "meso"}})
    return with_rest_spacing(run.with_fine_loops()).fabric


def _check_soft_run(run: Run) -> None:
    """Raise :class:`InputError` for tools, which see only the core of soft yarns, blind yarns and coarse beams."""
    if run.uses_tools:
        raise InputError(
            "fabric.knitting.soft_shell: plates and tools of a meso test do not touch the shell; choose a test "
            "without them"
        )
    if not run.model.meso.contact:
        raise InputError("model.meso.contact = false: yarns with a soft shell need contact; set it to true")
    loop, elements = run.fabric.loop_length_mm, run.model.meso.elements_per_loop
    if loop / elements > COARSEST * run.fabric.knitting.beam_diameter_mm:
        fine = ceil(loop / (FINE * run.fabric.knitting.beam_diameter_mm))
        raise InputError(
            f"model.meso.elements_per_loop = {elements}: beams of {loop / elements:.3g} mm are too long for a core of "
            f"{run.fabric.knitting.beam_diameter_mm:.3g} mm; use at least {fine}"
        )


def _relax_freely(run: Run) -> Numbers:
    """Size (2,) [mm] of the cell of ``run`` without mean stress, and the nodes of its yarns."""
    none = Quantity(value=0.0, source="derived", ref="relaxed fabric")
    contact = run.fabric.contact.model_copy(update={"friction_coefficient": none, "static_friction_coefficient": None})
    start = start_of_relaxation(run.fabric)
    smooth = run.model_copy(update={"fabric": start.model_copy(update={"contact": contact})})
    model = build_meso_cell(smooth, relaxed_cell(start), 1, 1)
    body = PeriodicBody(model, run.solver.safety, threads=1)
    body.free("ax", "by")
    for _ in range(CALLS):
        found = body.settle(FREE_AT_REST, FREE_PATIENT)
        if found.converged or found.residual < FREE_AT_REST**2:
            break
    if found.residual > FREE_RESTLESS:
        raise InputError(
            f"fabric.loop_length = {run.fabric.loop_length_mm:g} mm: no equilibrium of the free fabric is found "
            f"(residual contact-force imbalance {100.0 * found.residual:.2g} %, limit {100.0 * FREE_RESTLESS:g} %); "
            "change warp_density and weft_density, where the relaxation starts"
        )
    own = np.flatnonzero(model.owned)
    yarns = np.split(own, np.flatnonzero(np.diff(model.group.chain[own])) + 1)
    points = [model.position()[one].tolist() for one in yarns]
    return {"size": np.abs(model.lattice.diagonal()).tolist(), "points": points}


# Curl of fabric that nothing keeps flat: moment of the flat cell over its bending stiffness.
#
# Loops that are not fully set, or under tension on one side of the inlays, press towards one face. A cell held flat
# bears the moment M per length; let go it bends by kappa until M + D kappa = 0, with the bending stiffness D of the
# same cell. Each direction is taken by itself, the other one flat: a piece cannot curl both ways at once.

#: curvature [1/mm] to which the stiffness is the secant, and time to there [ms]
PROBE, WAY = 0.01, 10.0
#: residual forces over those of contacts in equilibrium, and most steps to it
CURL_AT_REST, CURL_PATIENT = 2e-3, 10_000


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
    held.settle(CURL_AT_REST, CURL_PATIENT)
    body = cell()
    body.bend(_bend_rate(-PROBE if held.bending_moment() > 0.0 else PROBE), along)
    body.settle(CURL_AT_REST, CURL_PATIENT)
    flat = body.bending_moment()
    body.advance(WAY)
    body.settle(CURL_AT_REST, CURL_PATIENT)
    return Curl(flat, (body.bending_moment() - flat) / body.cell.curvature)


def cell_curl(run: Run, axial_share: float = 1.0) -> dict[str, Curl]:
    """Curl of the cell of ``run``, at the draw-in that its fabric states, along its courses (weft) and wales (warp).

    Bent inlays lie about the surface that keeps its length: their tension bears no moment.
    """
    found = load_or_compute(
        run, {"curl": [PROBE, WAY, CURL_AT_REST, CURL_PATIENT], "axial_share": axial_share},
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


def _bend_rate(curvature: float) -> Table:
    """Rate [1/(mm ms)] that bends by ``curvature`` within :data:`WAY`, from rest to rest."""
    up = ramp(0.25 * WAY, curvature / (0.75 * WAY))
    down = tuple(WAY - t for t in reversed(up.time))
    return Table((*up.time, *down), (*up.value, *reversed(up.value)))
