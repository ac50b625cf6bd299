"""The meso model: one beam chain a yarn, on the control points of its centre-line spline."""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from knittest.config.run import Run
from knittest.errors import InputError
from knittest.fabric.strip import YarnPath
from knittest.fabric.variability import YarnDraws
from knittest.history import Mesh
from knittest.kernels.beam import rotary_inertia_factor, wave_speed
from knittest.kernels.state import Beams, ContactLaw
from knittest.materials.yarn_section import SYSTEMS, Section, sections
from knittest.models.contact_tracker import YarnContactGroup
from knittest.models.explicit_model import make_nodes, make_partitions
from knittest.models.yarn_model import YarnModel

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: pieces of one yarn closer along it than this share of half a bend plus a margin [mm] never touch
BEND_MARGIN = 0.2
#: strength of a yarn away from its weakest place, above its drawn strength, relative
STRENGTH_MARGIN = 0.15
#: share of critical damping of a touching pair of nodes
CONTACT_DAMPING = 0.1
#: share of an average crossing's penalty that one node can feel, times two for two contacts on a piece
CONTACT_STEP_SHARE = 2.0


def build_meso(run: Run, paths: list[YarnPath], draws: dict[str, YarnDraws]) -> YarnModel:
    """Build chains for ``paths``; ``draws`` holds the scatter of each system, indexed by ``YarnPath.index``."""
    cards = sections(run.fabric)
    paths = sorted(paths, key=lambda p: (SYSTEMS.index(p.system), p.index))
    count = np.array([len(p.points) for p in paths])
    start = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
    system = np.array([SYSTEMS.index(p.system) for p in paths], np.int64)
    chain = np.repeat(np.arange(len(paths)), count).astype(np.int64)
    position = np.concatenate([p.points for p in paths])
    chord = np.diff(position, axis=0, append=position[-1:] + 1.0)
    joined = np.append(chain[1:] == chain[:-1], False)
    length = np.where(joined, np.linalg.norm(chord, axis=1), 1.0)
    mass, inertia, stiffness = _lump(
        cards, system[chain], joined, length, _true_length(run, paths, length, joined, start)
    )
    step, mass, inertia, added = _scale_mass(run, mass, inertia, stiffness)
    beams = _beams(cards, paths, draws, chord, length, joined, chain)
    cells = np.flatnonzero(joined)
    mesh = Mesh(
        "beams",
        np.column_stack([cells, cells + 1]),
        system[chain[cells]],
        SYSTEMS,
        chain[cells],
        np.array([c.radius for c in cards])[system[chain[cells]]],
    )
    parts = make_partitions(start, system)
    group = _contact_group(run, cards, system[chain], joined, length, mass, chain, parts.node)
    return YarnModel(
        make_nodes(position, mass, inertia), parts, mass, inertia, mesh, step, added,
        wave_speed(cards[0].axial, cards[0].linear_density), beams, cells, group,
        run.model.meso.contact,
    )  # fmt: skip


def _true_length(run: Run, paths: list[YarnPath], length: Array, joined: NDArray[np.bool_], start: Index) -> Array:
    """Ratio of real yarn length to control polygon for each node's chain, so that the yarn's mass is exact."""
    ratio = np.ones(len(length))
    for path, a, b in zip(paths, start[:-1], start[1:], strict=True):
        if path.system == "knit":
            polygon = float(length[a:b][joined[a:b]].sum())
            loops = (b - a - 1) / run.model.meso.elements_per_loop
            ratio[a:b] = loops * run.fabric.kernel("loop_length") / polygon
    return ratio


def _lump(
    cards: tuple[Section, ...], system: Index, joined: NDArray[np.bool_], length: Array, ratio: Array
) -> tuple[Array, Array, Array]:
    """Nodal mass [g], rotary inertia [g mm^2] and the sum of adjoining axial stiffnesses [N/mm]."""
    density = np.array([c.linear_density for c in cards])[system]
    axial = np.array([c.axial for c in cards])[system]
    half = np.where(joined, 0.5 * density * length * ratio, 0.0)
    stretch = np.where(joined, axial / length, 0.0)
    mass, stiffness = half.copy(), stretch.copy()
    mass[1:] += half[:-1]
    stiffness[1:] += stretch[:-1]
    spread = np.empty(len(length))
    for s, card in enumerate(cards):
        of = (system == s) & joined
        if of.any():
            mean = float(length[of].mean())
            alpha = rotary_inertia_factor(card.axial, card.shear, card.torsion, card.bending, mean)
            spread[system == s] = alpha * float(length[of].max()) ** 2
    return mass, spread * mass, stiffness


def _scale_mass(run: Run, mass: Array, inertia: Array, stiffness: Array) -> tuple[float, Array, Array, float]:
    """Critical step [ms] by nodes (omega^2 <= (2 k_sum + contact) / m) and mass scaling to the target step."""
    penalty = CONTACT_STEP_SHARE * run.fabric.contact.kernel("normal_stiffness") if run.model.meso.contact else 0.0
    load = 2.0 * stiffness + penalty
    interior = mass > 0.0
    step = float(np.min(2.0 * np.sqrt(mass[interior] / load[interior])))
    if run.solver.target_step is None:
        return step, mass, inertia, 0.0
    wanted = run.solver.kernel("target_step") / run.solver.safety
    scaled = np.maximum(mass, 0.25 * wanted**2 * load)
    added = float(scaled.sum() / mass.sum() - 1.0)
    if 100.0 * added > run.solver.max_added_mass:
        raise InputError(
            f"solver.target_step = {run.solver.target_step:g} us adds {100 * added:.1f} % mass, more than "
            f"solver.max_added_mass = {run.solver.max_added_mass:g} %; "
            f"the unscaled step is {1e3 * run.solver.safety * step:.4f} us"
        )
    return wanted, scaled, inertia * scaled / mass, added


def _beams(
    cards: tuple[Section, ...], paths: list[YarnPath], draws: dict[str, YarnDraws], chord: Array, length: Array,
    joined: NDArray[np.bool_], chain: Index,
) -> Beams:  # fmt: skip
    tangent = np.where(joined[:, None], chord / length[:, None], [1.0, 0.0, 0.0])
    fail = _fail_strains(paths, draws)
    slack = np.array([draws[p.system].slack[p.index] for p in paths])[chain]
    n_hinges = max(len(c.hinge_strain) for c in cards)
    knees, slopes = np.zeros((len(cards), n_hinges)), np.zeros((len(cards), n_hinges))
    for s, card in enumerate(cards):
        knees[s, : len(card.hinge_strain)] = card.hinge_strain
        slopes[s, : len(card.hinge_slope)] = card.hinge_slope
    stiffness = np.array([[c.compression, c.shear, c.torsion, c.bending] for c in cards])
    return Beams(
        tangent.T.copy(), 1.0 / length, joined.astype(float), fail, slack, np.where(joined, np.inf, np.nan),
        stiffness, knees, slopes,
    )  # fmt: skip


def _fail_strains(paths: list[YarnPath], draws: dict[str, YarnDraws]) -> Array:
    """Failure strain of each element: the drawn one at the yarn's weakest place, more elsewhere.

    A yarn breaks once. With equal strength everywhere its elements, which share one force, would all go in one step.
    """
    strains = []
    for path in paths:
        drawn, n = draws[path.system], len(path.points)
        strain = np.full(n, (1.0 + STRENGTH_MARGIN) * drawn.fracture_strain[path.index])
        strain[min(int(drawn.weakest[path.index] * (n - 1)), n - 2)] = drawn.fracture_strain[path.index]
        strains.append(strain)
    return np.concatenate(strains)


def _contact_group(
    run: Run, cards: tuple[Section, ...], system: Index, joined: NDArray[np.bool_], length: Array, mass: Array,
    chain: Index, node_cut: Index,
) -> YarnContactGroup:  # fmt: skip
    n = len(system)
    radius = np.array([c.radius for c in cards])[system]
    before = np.concatenate([[False], joined[:-1]])
    is_piece = joined & before
    half_piece = np.full(n, 0.0)
    half_piece[1:] = 0.25 * (length[1:] + length[:-1])
    mean = np.array([length[(system == s) & joined].mean() if (system == s).any() else 1.0 for s in range(len(cards))])
    bend = 1.2 * (0.5 * np.pi * 2.0 * radius + BEND_MARGIN)
    normal = run.fabric.contact.kernel("normal_stiffness")
    law = ContactLaw(
        normal,
        normal * run.fabric.contact.kernel("tangential_ratio"),
        run.fabric.contact.kernel("friction_coefficient"),
        2.0 * CONTACT_DAMPING * sqrt(normal * 0.5 * float(mass[is_piece].min())),
    )
    return YarnContactGroup(
        radius, half_piece, np.ceil(bend / mean[system]).astype(np.int64), is_piece, chain, node_cut, law
    )
