"""The meso model: yarn paths and their drawn scatter as beam chains."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from knittest.config.run import Run
from knittest.fabric.strip import YarnPath
from knittest.fabric.variability import YarnDraws
from knittest.materials.patch import fabric_patch
from knittest.materials.yarn_section import STRENGTH_MARGIN, SYSTEMS, sections
from knittest.models.chain_layout import Chain
from knittest.models.chain_step import MassScaling
from knittest.models.chains import build_chains
from knittest.models.yarn_contact import YarnContact
from knittest.models.yarn_model import YarnModel

Array = NDArray[np.float64]

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
    cards = sections(run.fabric, axial_share)
    rows = 1 + max((p.index for p in paths if p.system == "knit"), default=0)
    chains = [
        Chain(
            path.points,
            cards[SYSTEMS.index(path.system)],
            SYSTEMS.index(path.system),
            _fail_strain(len(path.points), draws[path.system], path.index) / axial_share,
            float(draws[path.system].slack[path.index]),
            stretch(run, path.uncut),
            _degree_of_set(run, path, rows),
            UPRIGHT,
            draw_in=_draw_in(run, path, rows, draws[path.system].loop),
        )
        for path in sorted(paths, key=chain_order)
    ]
    contact = yarn_contact(run) if run.model.meso.contact else None
    if contact is not None and not rubbing:
        contact = replace(contact, friction=0.0, static=None, patch=None)
    return build_chains(chains, SYSTEMS, contact, mass_scaling(run))


def chain_order(path: YarnPath) -> tuple[int, int]:
    """Key by which the chains of a model are sorted: by system, and yarn by yarn."""
    return SYSTEMS.index(path.system), path.index


def yarn_contact(run: Run) -> YarnContact:
    """Contact between the yarns of the fabric."""
    card = run.fabric.contact
    normal = card.normal_stiffness_n_per_mm
    static, compaction = card.static_friction_coefficient, card.compaction
    return YarnContact(
        normal,
        normal * card.tangential_ratio.value,
        card.friction_coefficient.value,
        static=None if static is None else static.value,
        compaction=None if compaction is None else (compaction.exponent, compaction.depth_mm),
        patch=fabric_patch(run.fabric),
        pressed=run.fabric.knitting.settled,
        cut=CUT,
    )


def mass_scaling(run: Run) -> MassScaling | None:
    """Scaling to the step that the run asks for."""
    if (step := run.solver.target_step_ms) is None:
        return None
    safety = run.solver.safety
    return MassScaling(step / safety, 0.01 * run.solver.max_added_mass, safety)


def stretch(run: Run, path: YarnPath) -> float:
    """Real loop length over that of the control polygon; reinforcing yarns lie on their polygon."""
    if path.system != "knit":
        return 1.0
    polygon = float(np.linalg.norm(np.diff(path.points, axis=0), axis=1).sum())
    loops = (len(path.points) - 1) / run.model.meso.elements_per_loop
    return loops * run.fabric.loop_length_mm / polygon


def _degree_of_set(run: Run, path: YarnPath, rows: int) -> Array:
    """Set of each element; loops at the cut edges, which nothing holds, are taken as set."""
    return np.where(_held(run, path, rows), run.fabric.knitting.degree_of_set.value, 1.0)


def _draw_in(run: Run, path: YarnPath, rows: int, loop: Array | None) -> Array:
    """Draw-in of each element, less than none in a course of longer loops; at the cut edges, which nothing holds, none.

    ``loop`` (rows,) are the drawn lengths of the courses' loops over their mean [-], None where all are alike.
    """
    own = 1.0 if path.system != "knit" or loop is None else float(loop[path.index])
    drawn = 1.0 - (1.0 - (run.fabric.knitting.draw_in_fraction or 0.0)) * own
    return np.where(_held(run, path, rows), drawn, 0.0)


def _held(run: Run, path: YarnPath, rows: int) -> NDArray[np.bool_]:
    """Elements of loops that other loops hold on all sides."""
    held = np.full(len(path.points) - 1, path.system == "knit" and path.index not in (0, rows - 1))
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
