"""Sections of yarns under tension stay across their axis up to fracture, so that their strain is that of the yarn.

Sections of a straight beam of stretch l = 1 + e that all turn by t against its axis store, per length, the integral of
the law up to l cos(t) - 1, and GA (l sin t)^2 / 2. The second derivative by t at 0 is l (GA l - N). A yarn is stable
while GA > N / (1 + e); beyond, its sections turn until N of their own strain is GA (1 + e), and that strain stays.
"""

from typing import Any

import numpy as np
import pytest

from knittest.base.errors import NumericalError
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.laboratory.cell.test import Cell
from knittest.materials.yarn_section import MOST_SHEAR, SHEAR_MARGIN, Section, largest_strain, sections
from knittest.pose import ALL, Body, Chain, constant, linear_laminate, section
from knittest.solve.state import SILENT

HARDENING = "law={kind: table, points: [[0, 0], [4, 40], [12, 680], [20, 1320]]}"
AREA = 0.25
LENGTH, PIECES = 10.0, 20


def user(name: str, value: float) -> str:
    return f"fabric.reinforcing.{name}={{value: {value}, source: user}}"


def run(*sets: str, fracture: float = 12.0, test: str = "cell", **options: Any) -> Run:
    """A fabric with inlays of 1 GPa on 0.25 mm2 that break at ``fracture`` [%]."""
    soft = (user("youngs_modulus", 1.0), user("load_area", AREA), user("fracture_strain", fracture))
    bending = "{warp: {value: 1, source: user}, weft: {value: 1, source: user}}"
    fabric = (*soft, f"fabric.reinforcing.bending_stiffness={bending}")
    return resolve(test=test, variant="2", scale="meso", parameters="as-measured", sets=[*fabric, *sets], **options)


def force(card: Section, strain: np.ndarray) -> np.ndarray:
    """Axial force [N] by the hinges of ``card``."""
    return (card.hinge_slope * np.maximum(np.asarray(strain)[..., None] - card.hinge_strain, 0.0)).sum(axis=-1)


def line(height: float = 0.0) -> np.ndarray:
    return np.column_stack([np.linspace(0.0, LENGTH, PIECES + 1), np.full((PIECES + 1, 2), [0.0, height])])


def clamped(*chains: Chain) -> tuple[Body, int]:
    """Chains from one jaw to another, which is pulled along x at 0.2 mm/ms; spins of 1e-6 rad/ms disturb them."""
    body = Body.of_chains(chains, damping=0.05)
    first = np.arange(len(chains)) * (PIECES + 1)
    for dof in ALL:
        body.boundary.move(first, dof)
    pulled = [body.boundary.move(first + PIECES, dof, constant(0.2 if dof == "x" else 0.0)) for dof in ALL]
    body.spin[:] = 1e-6 * np.random.default_rng(0).standard_normal(body.spin.shape)
    return body, pulled[0]


@pytest.mark.parametrize(("strain", "shear"), [(0.05, 40.0), (0.10, 40.0), (0.10, 150.0), (0.12, 153.0)])
def test_resistance_to_turning_is_that_of_the_closed_form(strain: float, shear: float) -> None:
    """l (GA l - N) per length by the energy of sections turned by 1e-3: the next term is of its square."""
    card = section(250.0, 1.0, 0.2, 1e-3, law=([0, 0.04, 0.12, 0.2], [0, 10, 170, 330]), shear=shear)
    body = Body.of_chains([Chain(line(), card)])
    stretch, turn, stored = 1.0 + strain, 1e-3, []
    for angle in (0.0, turn):
        body.place(line() * [stretch, 1.0, 1.0], (0.0, 0.0, angle))
        stored.append(sum(float(e.sum()) for e in body.model.beam_energies().values()))
    expected = stretch * (shear * stretch - float(force(card, np.array(strain))))
    assert 2.0 * (stored[1] - stored[0]) / turn**2 / LENGTH == pytest.approx(expected, abs=1e-3 * shear)


LAWS = {
    "table": (HARDENING, 12.0),
    "steep at its end": ("law={kind: table, points: [[0, 0], [40, 50], [48, 850]]}", 48.0),
    "toe": ("law={kind: toe, toe_strain: 2}", 50.0),
    "linear": ("law={kind: linear}", 50.0),
    "short": ("law={kind: linear}", 1.0),
}


@pytest.mark.parametrize("name", LAWS)
def test_no_law_reaches_the_threshold_up_to_fracture(name: str) -> None:
    """GA / (N / (1 + e)) is at least the margin on a fine grid of strains, for the strongest element of all draws."""
    law, fracture = LAWS[name]
    found = run(f"fabric.reinforcing.{law}", "rig.path=shear", fracture=fracture)
    strain = np.linspace(0.0, largest_strain(found.fabric.reinforcing), 2001)[1:]
    assert strain[-1] == pytest.approx(1.15e-2 * fracture)
    for card in sections(found.fabric)[:2]:
        margin = card.shear / (force(card, strain) / (1.0 + strain)).max()
        assert margin >= (1.0 - 1e-9) * min(SHEAR_MARGIN, MOST_SHEAR * (1.0 + strain[-1]) / strain[-1])
        assert margin > 1.2
        assert card.shear < card.axial


@pytest.mark.parametrize("variant", ["1", "2"])
def test_shipped_yarns_keep_the_isotropic_shear_stiffness(variant: str) -> None:
    """5/6 EA / 2.6: their laws are linear and end at 1 and 2.7 %."""
    fabric = resolve(test="cell", variant=variant, scale="meso").fabric
    for card in sections(fabric):
        assert card.shear == pytest.approx(card.axial * 5.0 / 6.0 / 2.6, rel=1e-14)


def test_five_hardening_yarns_break_at_their_strength() -> None:
    """5 x 680 MPa x 0.25 mm2 = 850 N. With GA of 1 GPa they would hold 5 x 346 MPa x 0.25 mm2 = 432 N, and not break.

    The force is the mean of 20 steps, in which it rises by less than 0.1 %; waves of the pull are 0.3 % of it.
    """
    card = sections(run(f"fabric.reinforcing.{HARDENING}").fabric)[0]
    weakest = np.where(np.arange(PIECES) == PIECES // 2, 0.12, 0.138)
    body, pulled = clamped(*(Chain(line(5.0 * k), card, fail_strain=weakest) for k in range(5)))
    forces: list[float] = []
    body.advance(0.13 * LENGTH / 0.2, lambda b: forces.append(b.reaction(pulled)))
    assert max(forces) == pytest.approx(5 * 680.0 * AREA, rel=5e-3)
    assert (body.fields()["alive"].reshape(5, PIECES).min(axis=1) == 0.0).all()


def test_cell_of_hardening_yarns_carries_the_law_at_ten_per_cent() -> None:
    """Straight yarns: 1.10 / 1.006 - 1 = 9.34 %, 467.5 MPa x 0.25 mm2 x 0.28 yarns/mm = 32.7 N/mm; loops add 0.3.

    GA of 1 GPa let it rest at 346 MPa, 24.6 N/mm. Waves are straight to 1 % of the force.
    """
    found = run(
        f"fabric.reinforcing.{HARDENING}", "rig.path=warp", "rig.max_strain=10", "rig.wales=1", "rig.courses=1",
        preset="quick",
    )  # fmt: skip
    cell = Cell()
    prepared = cell.prepare(found)
    history, _ = cell.solve(prepared, found, SILENT)
    assert history.curve["warp_n_per_mm"][-1] == pytest.approx(33.0, rel=0.01)


def test_a_yarn_whose_sections_would_turn_stops_the_run() -> None:
    """Linear, EA = 100 N, GA = 20 N: N = GA (1 + e) at e = 25 %. Before, nothing is said."""
    card = section(100.0, 1.0, 0.2, 1e-3, shear=20.0)
    body, _ = clamped(Chain(line(), card))
    body.advance(0.245 * LENGTH / 0.2)
    with pytest.raises(NumericalError, match=r"yarn 1 \(node \d+\), .*exceeds GA \(1 \+ e\).*GA of at least 20\."):
        body.advance(0.01 * LENGTH / 0.2)


def test_a_state_at_rest_whose_sections_have_turned_is_an_error() -> None:
    """A load of 30 N on EA = 100 N and GA = 20 N: straight yarns would be stretched by 30 %, N = 1.15 GA (1 + e)."""
    body = Body.of_chains([Chain(line(), section(100.0, 1.0, 0.2, 1e-3, shear=20.0))])
    body.boundary.move([0], ALL)
    body.boundary.load([PIECES], "x", 30.0)
    with pytest.raises(NumericalError, match="unstable in shear"):
        body.relax()


def test_a_table_of_a_posed_section_is_followed_to_its_end() -> None:
    """The default GA is enough for the table, 2 x 330 N / 1.2, and not only for its first tangent, 0.32 x 250 N."""
    card = section(250.0, 1.0, 0.2, 1e-3, law=([0, 0.04, 0.12, 0.2], [0, 10, 170, 330]))
    assert card.shear == pytest.approx(2.0 * 330.0 / 1.2, rel=1e-12)


def test_a_softened_yarn_carries_its_forces_at_larger_strains() -> None:
    """N(e / share) = N of the yarn at e for a table as for a line, so that it breaks at its strength."""
    fabric = run(f"fabric.reinforcing.{HARDENING}").fabric
    strain = np.array([0.02, 0.06, 0.12])
    whole, soft = sections(fabric)[0], sections(fabric, 0.05)[0]
    assert force(soft, strain / 0.05) == pytest.approx(force(whole, strain), rel=1e-12)
    assert soft.axial == pytest.approx(0.05 * whole.axial, rel=1e-12)


def test_directors_of_shells_resist_turning_under_any_tension() -> None:
    """A shell's fibre strain is the stretch of its surface, which directors do not enter: transverse stiffness x l^2.

    At a fibre force of 500 N/mm, a million times the transverse shear stiffness of 0.0005 N/mm.
    """
    points = np.array([[x, y, 0.0] for y in range(4) for x in range(3)], float)
    cells = [[x + 3 * y, x + 1 + 3 * y, x + 4 + 3 * y, x + 3 + 3 * y] for y in range(3) for x in range(2)]
    laminate = linear_laminate((1000.0, 1000.0), (1e-4, 1e-4), 0.5, 1.0)
    body, stretch, turn, stored = Body.of_shells(points, cells, laminate, 8e-4, 1.0), 1.5, 1e-2, []
    for angle in (0.0, turn):
        body.place(points * [1.0, stretch, 1.0], (angle, 0.0, 0.0))
        stored.append(float(body.model.stored_energies().internal.sum()))
    resistance = 2.0 * (stored[1] - stored[0]) / turn**2 / 6.0
    assert resistance == pytest.approx(laminate.transverse[0] * stretch**2, rel=1e-3)
