"""The meso model of a periodic cell: relaxed yarn paths without scatter as chains that go on in their images."""

import numpy as np
from numpy.typing import NDArray

from knittest.config.run import Run
from knittest.fabric.cell import Cell
from knittest.fabric.strip import YarnPath, strip, wave_elements, wave_scale
from knittest.materials.yarn_section import SYSTEMS, sections
from knittest.models.meso import UPRIGHT, chain_order, mass_scaling, stretch, yarn_contact
from knittest.models.periodic import SLIDE, PeriodicChain, build_periodic
from knittest.models.periodic_model import PeriodicModel

Array = NDArray[np.float64]

#: way that yarns may slide past each other, over the larger of the spacings of wales and courses, at the least
LEAST_SLIDE = 0.2


def cell_paths(run: Run, cell: Cell, wales: int, courses: int) -> list[YarnPath]:
    """Yarns of ``wales`` x ``courses`` cells, all alike, the last point of each the image of its first."""
    mesh = run.model.meso
    scales = {s: wave_scale(cell, s, wave_elements(cell, s, mesh.elements_per_wave)) for s in ("warp", "weft")}
    amplitude = {"warp": np.full(wales, scales["warp"]), "weft": np.full(courses, scales["weft"])}
    paths = strip(cell, wales, courses, mesh.elements_per_loop, mesh.elements_per_wave, amplitude)
    return [p for p in paths if mesh.knitting or p.system != "knit"]


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
    radius, or by :data:`LEAST_SLIDE` of the larger spacing. Yarns of the system ``about`` lie about z = 0, the surface
    that bending leaves its length. Yarns do not break: a cell has no weakest place.
    """
    cards = sections(run.fabric, axial_share)
    paths = sorted(cell_paths(run, cell, wales, courses), key=chain_order)
    middle = np.mean([p.points[:-1, 2].mean() for p in paths if p.system == about]) if about else 0.0
    chains = [
        PeriodicChain(
            path.points[:-1] - [0.0, 0.0, middle],
            cards[SYSTEMS.index(path.system)],
            SYSTEMS.index(path.system),
            stretch=stretch(run, path),
            degree_of_set=run.fabric.knitting.degree_of_set.value if path.system == "knit" else 1.0,
            draw_in=(run.fabric.knitting.draw_in_fraction or 0.0) if path.system == "knit" else 0.0,
            along=1 if path.system == "warp" else 0,
            normal=UPRIGHT,
        )
        for path in paths
    ]
    contact = yarn_contact(run) if run.model.meso.contact else None
    lattice, added = lattice_of(cell, wales, courses), mass_scaling(run)
    radius = max(float(card.radius) for card in cards)
    slide = max(slide, LEAST_SLIDE * max(run.fabric.wale_spacing, run.fabric.course_spacing) / radius)
    return build_periodic(chains, lattice, SYSTEMS, contact, added, shrink=shrink, slide=slide)


def lattice_of(cell: Cell, wales: int, courses: int) -> Array:
    """Vectors (2, 3) [mm] by which ``wales`` x ``courses`` cells repeat."""
    return np.array([wales * cell.periods["weft"], courses * cell.periods["warp"]])
