"""Energy by mechanism: of all parts of a model, in the ledger of a run, and as what the work of a stamp went into."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from plain import plain
from test_plain_beam import Chain, rotated
from test_tool_room import Fall

from benchmarks.forming_energies import ROWS, STAMP, shares, spent
from knittest.base.history import History, Mesh
from knittest.kernels import explicit, monitor
from knittest.kernels.beam import beam_energies
from knittest.kernels.shell_output import shell_energies
from knittest.kernels.state import Partitions, Tally
from knittest.kernels.vec import PARTITIONS
from knittest.laboratory.forming.results import MECHANISMS, stamp_work
from knittest.models import fabric_model, yarn_model
from knittest.models.explicit_model import StoredEnergies
from knittest.models.macro import build_sheet
from knittest.models.sections import linear_laminate
from knittest.solve import simulation
from knittest.solve.state import ModelStepper

PARTS = {"beams": ("warp", "weft", "knit"), "layers": ("weft1", "warp", "weft2", "knit"), "shells": ("fabric",)}
KNOWN = {"beams": yarn_model.MECHANISMS, "layers": yarn_model.MECHANISMS, "shells": fabric_model.MECHANISMS}


def ledger(kind: str) -> tuple[History, np.ndarray]:
    """A history whose energies are drawn at random and booked by a run of ``kind``, and the work that they are."""
    rng, parts = np.random.default_rng(4), PARTS[kind]
    time = np.array([0.0, 1.0, 2.0, 3.0])
    rows = []
    for k, now in enumerate(time):
        mechanisms = {name: k * rng.uniform(1.0, 2.0, len(parts)) for name in KNOWN[kind]}
        internal = np.sum(list(mechanisms.values()), axis=0)
        stored = StoredEnergies(internal, 3.0 * k, 0.7 * k, mechanisms=mechanisms, tools=1.3 * k, tool_kinetic=0.2 * k)
        columns = k * rng.uniform(1.0, 2.0, (PARTITIONS, 7))
        columns[:, 0] = 0.0
        columns[:, 1] = columns[:, 4:].sum(axis=1) + 1.0
        tally = SimpleNamespace(energy=columns)
        taken = internal.sum() + 4.3 * k + 0.7 * k + columns[:, 1:4].sum() + 0.9 * k + 0.6 * k
        columns[0, 0] = taken + 0.05 * k - 0.3 * k  # an error of the balance, and what contacts found late were given
        run = SimpleNamespace(
            model=SimpleNamespace(mesh=SimpleNamespace(part_names=parts)), tally=tally, time=now, kinetic=0.4 * k,
            damping_loss=0.9 * k, energy_rows=rows, start_energy=np.zeros(len(parts) * (1 + len(mechanisms)) + 3),
            recovered_energy=0.3 * k, guide_energy=0.0, rig=SimpleNamespace(relaxed_rows=0),
        )  # fmt: skip
        run.work, run.friction_losses = (
            (lambda run=run: ModelStepper.work(run)),
            (lambda run=run: ModelStepper.friction_losses(run)),
        )
        rows.append(simulation._balance(run, stored))
    energies = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    mesh = Mesh(kind, np.zeros((0, 2), int), np.zeros(0, int), parts, np.zeros(0, int), np.zeros(0))
    curve = {"time_ms": time, "stamp_travel_mm": 2.0 * time, "stamp_force_n": 5.0 + 3.0 * time}
    return History(mesh, curve, energies), energies["external_mj"]


@pytest.mark.parametrize("kind", list(PARTS))
def test_mechanisms_are_the_whole_work_each_energy_counted_once(kind):
    history, work = ledger(kind)
    assert history.energies["balance_error_mj"] == pytest.approx(0.05 * np.arange(4.0))
    table = stamp_work(history)
    # force 5 + 3 t at 2 mm / ms
    assert table["stamp_mj"] == pytest.approx(2.0 * (5.0 * np.arange(4) + 1.5 * np.arange(4) ** 2))
    assert table["stamp_mj"] + table["holder_and_weight_mj"] == pytest.approx(work)
    named = [name for name in MECHANISMS if f"{name}_mj" in table]
    assert sum(table[f"{name}_mj"] for name in named) == pytest.approx(work)
    assert set(named) == set(MECHANISMS) - (
        {"shear", "in_plane_bending"} if kind != "shells" else {n for n in MECHANISMS if "loop" in n} | {"torsion"}
    )
    assert table["tool_contact_mj"] == pytest.approx(1.3 * np.arange(4.0))
    assert table["tool_friction_mj"] == pytest.approx(history.energies["friction_tools_mj"])
    tools, parts = history.energies["friction_tools_mj"], ("spin", "shear")
    others = sum(history.energies[f"friction_{name}_mj"] for name in parts)
    assert table["fabric_friction_mj"] == pytest.approx(others + PARTITIONS) and (tools[1:] > 0.0).all()


@pytest.mark.parametrize(
    ("about", "number", "stiffness"), [("normal", 1, 670.0), ("binormal", 1, 70.0), ("tangent", 2, 40.0)]
)
def test_a_beam_that_turns_stores_energy_of_that_turn_alone(about, number, stiffness):
    """EI phi^2 / 2 L of either axis as bending, GJ phi^2 / 2 L as torsion."""
    chain = Chain(excess=600.0)
    tangent, normal = chain.beams.tangent[:, 0], chain.beams.normal[:, 0]
    axis = {"normal": normal, "binormal": np.cross(tangent, normal), "tangent": tangent}[about]
    chain.nodes.rotation[:] = np.array([[1.0], [0.0], [0.0], [0.0]])
    for node, turn in enumerate((-0.5e-3 * axis, 0.5e-3 * axis)):
        chain.nodes.rotation[:, node] = rotated(chain.nodes.rotation[:, node], turn)
    chain.nodes.position[:, 1] = chain.nodes.position[:, 0] + tangent / chain.beams.inv_length[0]
    found = plain(beam_energies)(0, 0, chain.nodes, chain.beams)
    expected = np.zeros(3)
    expected[number] = 0.5 * stiffness * 1e-6 * chain.beams.inv_length[0]
    assert found == pytest.approx(expected, abs=1e-5 * expected[number])


def test_a_chain_stores_what_its_living_beams_do():
    chain, parts = Chain(excess=600.0), Partitions(*(np.zeros(0, int) for _ in Partitions._fields))
    parts = parts._replace(span=np.array([[0, 3, 0]]))
    each = np.array([plain(beam_energies)(i, 0, chain.nodes, chain.beams) for i in range(3)])
    assert plain(monitor.section_energies)(chain.nodes, parts, chain.beams) == pytest.approx(each.sum(axis=0)[None])
    chain.beams.alive[1] = 0.0
    found = plain(monitor.section_energies)(chain.nodes, parts, chain.beams)
    assert found == pytest.approx((each[0] + each[2])[None]) and (found > 0.0).all()


def sheet(**changes):
    """One square shell of 4 mm."""
    card = linear_laminate((900.0, 900.0), (5.0, 5.0), 0.5, 2.2, twist=0.4)._replace(**changes)
    points = 4.0 * np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    return build_sheet(points, np.array([[0, 1, 2, 3]]), card, 1e-3, 2.2)


def test_a_shell_stores_stretching_bending_and_shear_apart():
    """E t e^2 / 2, S g^2 / 2 of yarns that turn without stretching, D k^2 / 2 of a strip whose ends turn by k L / 2."""

    def energies(model):
        return np.array(plain(shell_energies)(model.nodes, model.shells, model.laminate)) / 16.0

    stretched, sheared, bent = sheet(), sheet(), sheet()
    stretched.nodes.position[0] *= 1.01
    assert energies(stretched) == pytest.approx([0.5 * 900.0 * 1e-4, 0.0, 0.0, 0.0], abs=1e-9)
    y = sheared.nodes.position[1].copy()
    sheared.nodes.position[0] += np.sin(0.3) * y
    sheared.nodes.position[1] = np.cos(0.3) * y
    found = energies(sheared)
    assert found[:3] == pytest.approx([0.0, 0.0, 0.5 * 0.5 * 0.09], abs=1e-12)
    half = 0.5e-3 * 4.0
    turn = np.where(bent.nodes.position[0, :4] > 2.0, -half, half)
    bent.nodes.rotation[:, :4] = [np.cos(0.5 * turn), 0.0 * turn, np.sin(0.5 * turn), 0.0 * turn]
    assert energies(bent)[:3] == pytest.approx([0.0, 0.5 * 5.0 * 1e-6, 0.0], rel=1e-3, abs=1e-15)


def test_losses_at_tools_and_in_shear_are_booked_as_such():
    """Nodes that slide on a plane rub at a tool; yarns that shear rub in the shear of shells."""
    fall = Fall()
    fall.tools.law[:, 2:4] = 0.3
    for _ in range(200):
        fall.step()
    tools = fall.tally.energy.sum(axis=0)
    assert tools[5] == tools[1] > 0.0 and tools[4] == tools[6] == 0.0
    shares = explicit.shell_share.py_func
    tally = Tally(*(np.zeros((PARTITIONS, 9)) for _ in Tally._fields))
    model = sheet()
    given = shares.__globals__ | {
        "shell_forces": lambda *_: (0.25, 1.5), "bend_forces": lambda *_: 0.0,
    }  # fmt: skip
    share = type(shares)(shares.__code__, given, "shell_share")
    share(0, 0.0, model.nodes, model.shells, model.laminate, model.bends, tally, np.zeros(1))
    assert tally.energy[0].tolist() == [0.0, 1.5, 0.25, 0.0, 0.0, 0.0, 1.5, 0.0, 0.0]


def test_shares_of_a_difference_are_the_whole_and_miss_no_mechanism():
    """At 3 mm of 4: half of what each mechanism has at 2 and at 4 mm; what the holder gives is taken off."""
    assert sorted(name for names in ROWS.values() for name in names) == sorted(MECHANISMS)
    drawn = []
    for kind in ("beams", "shells"):
        work = pd.DataFrame(stamp_work(ledger(kind)[0]))
        drawn.append(spent(work, 3.0))
        assert drawn[-1][STAMP] == pytest.approx(work["stamp_mj"][1:3].mean())
        assert drawn[-1]["friction at tools"] == pytest.approx(work["tool_friction_mj"][1:3].mean())
    found = shares(*({**one, STAMP: one[STAMP] + k} for k, one in enumerate(drawn)))
    assert found.pop(STAMP) == 1.0
    assert sum(found.values()) == pytest.approx(0.0, abs=1e-9)  # the stamp's work was changed by hand
