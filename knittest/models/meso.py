"""The meso models: yarn paths of a specimen with their drawn scatter, or of a periodic cell without, as beam chains."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from knittest.base.arrays import Array, Flags
from knittest.config.fabric import Fabric
from knittest.config.run import Run
from knittest.config.structure import KNIT
from knittest.fabric.cell import Cell
from knittest.fabric.strip import YarnPath, strip
from knittest.fabric.topology import YarnDraws
from knittest.materials.soft_shell import SoftShell
from knittest.materials.yarn_section import STRENGTH_MARGIN, fabric_patch, sections, systems_of
from knittest.models.chains import Chain, MassScaling, build_chains
from knittest.models.contact_tracker import PORTION
from knittest.models.periodic import SLIDE, PeriodicChain, build_periodic
from knittest.models.periodic_model import PeriodicModel
from knittest.models.yarn_contact import YarnContact
from knittest.models.yarn_model import YarnModel

Path = TypeVar("Path", bound=YarnPath)
#: pieces at the end of yarns that do not press each other: jaws hold them side by side, nearer than they are wide
CUT = 2
#: elliptic sections start with their height across the fabric
UPRIGHT = np.array([0.0, 0.0, 1.0])


def build_meso(
    run: Run, paths: Sequence[YarnPath], draws: dict[str, YarnDraws], axial_share: float = 1.0, rubbing: bool = True
) -> YarnModel:
    """Build chains for ``paths``; ``draws`` holds the scatter of each system, indexed by ``YarnPath.index``.

    A test that pulls no yarn may keep a share of the axial stiffness only: the time step grows. Without ``rubbing``
    yarns touch free of friction.
    """
    cards, systems = sections(run.fabric, axial_share), systems_of(run.fabric)
    rows = 1 + max((p.index for p in paths if p.system == KNIT), default=0)
    chains = [
        Chain(
            path.points,
            cards[systems.index(path.system)],
            systems.index(path.system),
            _fail_strain(len(path.points), draws[path.system], path.index) / axial_share,
            float(draws[path.system].slack[path.index]),
            stretch(run, path.uncut_path),
            np.where(_held_elements(run, path, rows), run.fabric.knitting.degree_of_set.value, 1.0),
            UPRIGHT,
            loop_shortening=_loop_shortening(run, path, rows, draws[path.system].loop),
        )
        for path in in_chain_order(run.fabric, paths)
    ]
    contact = yarn_contact(run) if run.model.meso.contact else None
    if contact is not None:
        contact = replace(contact, compliant=has_compliant_loops(run.fabric))
    if contact is not None and not rubbing:
        contact = replace(contact, friction=0.0, static=None, patch=None)
    return build_chains(chains, systems, contact, mass_scaling(run))


def has_compliant_loops(fabric: Fabric) -> bool:
    """Tell whether loops alone carry a direction, or a loop that bends stores little energy, EI over its length.

    That is less than what a contact found late would be given at once (:data:`.contact_tracker.PORTION`).
    """
    loop = fabric.knitting
    given = 0.5 * fabric.contact.normal_stiffness_n_per_mm * (PORTION * 0.5 * loop.beam_diameter_mm) ** 2
    return not fabric.has_inlays_both_ways or given > loop.bending_stiffness_n_mm2 / fabric.loop_length_mm


def in_chain_order(fabric: Fabric, paths: Iterable[Path]) -> list[Path]:
    """``paths`` in the order of the chains of a model: by system, and yarn by yarn."""
    systems = systems_of(fabric)
    return sorted(paths, key=lambda path: (systems.index(path.system), path.index))


def yarn_contact(run: Run) -> YarnContact:
    """Contact between the yarns of the fabric."""
    card = run.fabric.contact
    normal = card.normal_stiffness_n_per_mm
    static, compaction = card.static_friction_coefficient, card.compaction
    loop, shell = run.fabric.knitting, None
    if (given := loop.soft_shell) is not None:
        shell = SoftShell(
            given.outer_diameter_mm, loop.beam_diameter_mm, given.rigidity_n_per_mm3, given.exponent.value
        )
    return YarnContact(
        normal,
        normal * card.tangential_ratio.value,
        card.friction_coefficient.value,
        static=None if static is None else static.value,
        compaction=None if compaction is None else (compaction.exponent, compaction.depth_mm),
        patch=fabric_patch(run.fabric),
        pressed=loop.starts_relaxed,
        cut=CUT,
        shell=shell,
    )


def mass_scaling(run: Run) -> MassScaling | None:
    """Scaling to the step that the run asks for."""
    if (step := run.solver.target_step_ms) is None:
        return None
    safety = run.solver.safety
    return MassScaling(step / safety, 0.01 * run.solver.max_added_mass, safety)


def stretch(run: Run, path: YarnPath) -> float:
    """Real loop length over that of the control polygon; reinforcing yarns lie on their polygon."""
    if path.system != KNIT:
        return 1.0
    polygon = float(np.linalg.norm(np.diff(path.points, axis=0), axis=1).sum())
    loops = (len(path.points) - 1) / run.model.meso.elements_per_loop
    return loops * run.fabric.loop_length_mm / polygon


def _loop_shortening(run: Run, path: YarnPath, rows: int, loop: Array | None) -> Array:
    """Draw-in of each element, less than none in a course of longer loops; at the cut edges, which nothing holds, none.

    ``loop`` (rows,) are the drawn lengths of the courses' loops over their mean [-], None where all are alike.
    """
    if run.fabric.has_soft_yarns:  # pairs of nodes touch, so the polygon has the length of the loops
        return np.full(len(path.points) - 1, _cell_shortening(run, path.uncut_path))
    own = 1.0 if path.system != KNIT or loop is None else float(loop[path.index])
    drawn = 1.0 - (1.0 - (run.fabric.knitting.loop_shortening_fraction or 0.0)) * own
    return np.where(_held_elements(run, path, rows), drawn, 0.0)


def _cell_shortening(run: Run, path: YarnPath) -> float:
    """Draw-in of a yarn of a cell, as in :func:`_loop_shortening`."""
    if path.system != KNIT:
        return 0.0
    if run.fabric.has_soft_yarns:
        return 1.0 - stretch(run, path)
    return run.fabric.knitting.loop_shortening_fraction or 0.0


def _held_elements(run: Run, path: YarnPath, rows: int) -> Flags:
    """Elements of loops that other loops hold on all sides."""
    held = np.full(len(path.points) - 1, path.system == KNIT and path.index not in (0, rows - 1))
    loop = run.model.meso.elements_per_loop
    held[:loop] = held[-loop:] = False
    return held


def _fail_strain(n: int, drawn: YarnDraws, index: int) -> Array:
    """Failure strain of each element: the drawn one at the yarn's weakest place, more elsewhere.

    A yarn breaks once. With equal strength everywhere its elements, which share one force, would all go in one step.
    """
    strain = np.full(n - 1, (1.0 + STRENGTH_MARGIN) * drawn.fracture_strain[index])
    strain[min(int(drawn.weakest[index] * (n - 1)), n - 2)] = drawn.fracture_strain[index]
    return strain


#: way that yarns may slide past each other, over the larger of the spacings of wales and courses, at the least
LEAST_SLIDE = 0.2


def cell_paths(run: Run, cell: Cell, wales: int, courses: int) -> list[YarnPath]:
    """Yarns of ``wales`` x ``courses`` cells, all alike, the last point of each the image of its first."""
    mesh, (across, along) = run.model.meso, cell.spec.repeat
    paths = strip(cell, wales * across, courses * along, mesh.elements_per_loop, mesh.elements_per_wave)
    return [p for p in paths if mesh.knitting or p.system != KNIT]


def build_meso_cell(
    run: Run,
    cell: Cell,
    wales: int = 2,
    courses: int = 2,
    axial_share: float = 1.0,
    shrink: float = 1.0,
    about: str = "",
    slide: float = SLIDE,
) -> PeriodicModel:
    """Model of ``wales`` x ``courses`` cells of the run's fabric that repeats without an edge.

    A test that pulls no yarn may keep a share of the axial stiffness only: the time step grows. Its mean deformation
    brings lines to ``shrink`` of their length at the least, and yarns past each other by ``slide`` of the largest
    radius, or by :data:`LEAST_SLIDE` of the larger spacing. Inlays of the direction ``about``, or all yarns where it
    has none, lie about z = 0, the surface that bending leaves its length. Yarns do not break: a cell has no weakest
    place.
    """
    cards, systems = sections(run.fabric, axial_share), systems_of(run.fabric)
    paths = in_chain_order(run.fabric, cell_paths(run, cell, wales, courses))
    bent = [one.name for one in run.fabric.inlays_along(about)] or systems
    middle = np.mean([p.points[:-1, 2].mean() for p in paths if p.system in bent]) if about else 0.0
    chains = [
        PeriodicChain(
            path.points[:-1] - [0.0, 0.0, middle],
            cards[systems.index(path.system)],
            systems.index(path.system),
            stretch=stretch(run, path),
            degree_of_set=run.fabric.knitting.degree_of_set.value if path.system == KNIT else 1.0,
            loop_shortening=_cell_shortening(run, path),
            along=cell.spec.axis(path.system),
            normal=UPRIGHT,
        )
        for path in paths
    ]
    contact = yarn_contact(run) if run.model.meso.contact else None
    lattice, added = lattice_of(cell, wales, courses), mass_scaling(run)
    radius = max(float(card.radius) for card in cards)
    slide = max(slide, LEAST_SLIDE * max(run.fabric.wale_spacing, run.fabric.course_spacing) / radius)
    return build_periodic(chains, lattice, systems, contact, added, shrink=shrink, slide=slide)


def lattice_of(cell: Cell, wales: int, courses: int) -> Array:
    """Vectors (2, 3) [mm] by which ``wales`` x ``courses`` cells repeat."""
    x, y = cell.spec.size
    return np.array([[wales * x, 0.0, 0.0], [0.0, courses * y, 0.0]])
