"""Decks read by Ansys' own reader of LS-DYNA keywords, which knows every field of every card by name."""

import numpy as np
import pytest
from deck_reader import BEAM, SHELL, deck_text

deck = pytest.importorskip("ansys.dyna.core.lib.deck", reason="needs ansys-dyna-core: .ci/run installs it")


def _read(text):
    found = deck.Deck()
    found.loads(text)
    unread = [str(k)[:60] for k in found.string_keywords]
    assert not unread, unread
    return found


def _named(found, name):
    return [k for k in found.all_keywords if type(k).__name__ == name]


def _close(frame, position):
    return np.allclose(frame[["x", "y", "z"]].to_numpy(float), position, atol=1e-9)


@pytest.fixture(scope="module")
def yarns():
    run, prepared, mass, text = deck_text("tensile", "warp", ["rig.width=12", "rig.gauge_length=12"], **BEAM)
    return run, prepared.model, mass, _read(text)


def test_yarns_are_read_back(yarns):
    _, model, mass, found = yarns
    (nodes,), (beams,) = _named(found, "Node"), _named(found, "ElementBeam")
    assert _close(nodes.nodes[: model.n_nodes], model.position()) and len(beams.elements) == 2 * len(model.mesh.cells)
    sections = {s.secid: s for s in _named(found, "SectionBeam")}
    parts = {p["pid"]: p for k in _named(found, "Part") + _named(found, "PartContact") for p in _parts(k)}
    materials = {m.mid: m for n in ("MatElastic", "MatCableDiscreteBeam") for m in _named(found, n)}
    assert {s.elform for s in sections.values()} == {2, 6}
    total = 0.0
    position, at = model.position(), dict(zip(nodes.nodes["nid"], range(len(nodes.nodes)), strict=True))
    for row in beams.elements.itertuples():
        part = parts[row.pid]
        section, material = sections[part["secid"]], materials[part["mid"]]
        length = np.linalg.norm(position[at[row.n2]] - position[at[row.n1]])
        total += material.ro * (_area(section) * length if section.elform == 2 else section.vol)
    assert total == pytest.approx(float(mass.sum()), rel=1e-4)


def test_cables_of_yarns_are_read_back(yarns):
    _, model, _, found = yarns
    curves = {c.lcid: c.curves for c in _named(found, "DefineCurve")}
    cables = _named(found, "MatCableDiscreteBeam")
    fails = np.unique(model.beams.fail_strain[model.element_node])
    assert np.allclose(np.unique([c.mxeps for c in cables]), fails, rtol=1e-6) and {c.iread for c in cables} == {1}
    for cable in cables:
        curve = curves[cable.lcid]
        steepest = np.max(np.diff(curve["o1"]) / np.diff(curve["a1"]))
        assert steepest == pytest.approx(0.99 * cable.e, rel=1e-4)


def test_contact_and_motion_of_yarns_are_read_back(yarns):
    run, _, _, found = yarns
    (contact,) = _named(found, "ContactAutomaticGeneral")
    friction = run.fabric.contact.friction_coefficient.value
    assert (contact.fs, contact.fd, contact.surfatyp, contact.soft, contact.ignore) == (friction, friction, 2, 1, 1)
    (motion,) = _named(found, "BoundaryPrescribedMotionSet")
    assert (motion.dof, motion.vad, motion.sf) == (2, 0, 1.0)
    (step,), (end,) = _named(found, "ControlTimestep"), _named(found, "ControlTermination")
    assert step.tssfac == run.solver.safety and end.endtim > 0.0
    (damping,) = _named(found, "DampingGlobal")
    assert damping.valdmp == run.solver.damping_per_ms


def test_a_sheet_and_its_tools_are_read_back():
    sets = ["rig.blank_holder_force=100", "model.macro.element_size=15", "rig.stamp.kind=hemisphere"]
    run, prepared, _, text = deck_text("forming", sets=sets, **SHELL)
    found, model, card = _read(text), prepared.model, prepared.model.laminate
    sheet, *tools = _named(found, "ElementShell")
    assert _close(_named(found, "Node")[0].nodes, model.position())
    assert (sheet.elements[["n1", "n2", "n3", "n4"]].to_numpy(int) - 1 == model.mesh.cells).all() and len(tools) == 4
    outer, middle = _named(found, "MatReinforcedThermoplastic")
    curves = {c.lcid: c.curves for c in _named(found, "DefineCurve")}
    thick = _named(found, "SectionShell")[0].t1
    for direction, name in enumerate(("lcef1", "lcef2")):
        force = sum(
            n * np.interp(0.01, *(curves[getattr(m, name)][k].to_numpy() for k in ("a1", "o1"))) * thick / 3.0
            for m, n in ((outer, 2), (middle, 1))
        )
        law = card.slope[direction] @ np.maximum(0.01 - card.knee[direction], 0.0) + 0.02 * card.outer[direction]
        assert force == pytest.approx(law, rel=1e-5)
    assert (outer.nfib, outer.aopt, outer.alph1, outer.alph2, outer.meth12) == (2, 2, 0, 90, 2)
    contacts = _named(found, "ContactAutomaticSurfaceToSurface")
    assert [(c.surfatyp, c.surfbtyp, c.sbst) for c in contacts] == [(3, 3, 0.01)] * 4
    assert {c.fs for c in contacts} == {run.rig.static_coefficient}
    assert [(m.cmo, m.con1, m.con2) for m in _named(found, "MatRigid")] == [(1, c, 7) for c in (4, 7, 4, 7)]
    (press,) = _named(found, "LoadRigidBody")
    assert press.dof == 3 and curves[press.lcid]["o1"].iloc[-1] == -100.0


def _area(section):
    """Area of a resultant beam from its card as it was read: the reader's ``a`` is that of a truss."""
    return float(str(section).splitlines()[-1][:10])


def _parts(keyword):
    """Rows of a *PART, of which Ansys' reader keeps a table, or of a *PART_CONTACT, which has fields."""
    table = getattr(keyword, "parts", None)
    if table is not None:
        return table.to_dict("records")
    return [{"pid": keyword.pid, "secid": keyword.secid, "mid": keyword.mid}]
