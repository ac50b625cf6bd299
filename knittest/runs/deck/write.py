"""A prepared specimen as a deck of LS-DYNA keywords, and what the deck does not express. None has been run in that
solver by its authors.
"""

from pathlib import Path

import numpy as np

import knittest
from knittest.base.errors import InputError
from knittest.base.files import write_atomic
from knittest.base.kinds import kinds
from knittest.config.run import Run
from knittest.export.keywords import KeywordFile
from knittest.kernels.shell_state import Laminate
from knittest.laboratory.base import Prepared
from knittest.laboratory.forming.rig import FormingTest
from knittest.laboratory.report_base import size_of
from knittest.models.boundary import TOOL_DAMPING, Boundary
from knittest.models.fabric_model import FabricModel
from knittest.models.yarn_model import YarnModel
from knittest.runs.deck.sheet import Rubbing, add_motions, add_part_set, add_sheet, add_tools, add_with_tool, add_within
from knittest.runs.deck.yarns import AXIAL_SHARE, MASS_SHARE, YarnParts, add_yarns


def not_expressed(run: Run, prepared: Prepared) -> list[str]:
    """Sentences on what the model of ``run`` has and its deck has not, with the numbers concerned."""
    model = prepared.model
    if isinstance(model, YarnModel):
        found = _of_yarns(run, model)
    else:
        assert isinstance(model, FabricModel)
        found = _of_shells(model.laminate)
    if isinstance(prepared.rig, FormingTest):
        found += _of_tools(prepared.rig)
    else:
        found.append("ending: the run ends at the largest strain or angle, not when the force has fallen")
    if (many := run.variability.specimens) > 1:
        found.append(f"ensemble: this is the first of {many} specimens")
    return [*found, "gates: whether a result counts (energies, penetration) is for its user to judge"]


def _of_yarns(run: Run, model: YarnModel) -> list[str]:
    law, beams = model.group.law, model.beams
    found = [
        f"compression of yarns, and tension within their slack: {100 * AXIAL_SHARE:g} % of the stiffness",
        f"after a cable has broken its beam stays, with {100 * AXIAL_SHARE:g} % of the axial stiffness and its bending",
        "transverse shear of yarns: rigid; their rotary inertia is the target's",
        f"mass: a share of {MASS_SHARE:g} lies on beams, the rest on cables, each as heavy as the mean of its part",
    ]
    if model.added_mass > 0.0:
        found.append(f"mass scaling: the {100 * model.added_mass:.3g} % that it added are spread evenly over a system")
    if model.contact:
        found += [
            "contact on smooth centre-lines: the target has straight pieces between the nodes, which lie off the curve",
            f"penalty of contact, {law.normal:g} N/mm, and sticking, {law.tangential:g} N/mm: the target's own",
        ]
        if law.linear or law.square or law.cubic:
            found.append("compaction of yarns: contact that stiffens with depth")
        if law.torsional:
            found.append(f"spin of crossings: friction against it, up to {law.torsional:.3g} N mm/rad")
    card = run.fabric.knitting
    if model.prestressed and card.degree_of_set.value < 1.0:
        found.append(
            f"set of loops: {card.degree_of_set.value:g} of their curvature is set, the rest bent in; here all is set"
        )
    if card.draw_in_fraction:
        found.append(f"draw-in: loops are {100 * card.draw_in_fraction:g} % shorter at rest and start under tension")
    if card.loop_scatter != "none":
        found.append("scatter of the loop length: courses rest longer or shorter than they lie; here all as they lie")
    if model.pressed:
        found.append("settling: yarns that overlap press each other, and the run begins at rest; this deck does not")
    if np.isinf(beams.fail_strain[model.element_node]).all():
        found.append("breaking: yarns of this run do not break")
    return found


def _of_shells(card: Laminate) -> list[str]:
    found = [
        f"breaking: shells are deleted at fibre strains of {100 * card.fail_strain[0]:.4g} % (warp) and "
        f"{100 * card.fail_strain[1]:.4g} % (weft); here nothing breaks",
        "measures: curves are force over reference width and thickness; the target takes them as true stresses on its "
        "own thickness, which differs by the strain, and by what shear takes of the area (13 % at 30 deg)",
        "twisting: the share of the layers' shear at their offset, for the share at half the thickness",
        "hourglass control: shells are fully integrated",
    ]
    if card.shear_friction:
        found.append(f"friction in shear: {100 * card.shear_friction:g} % of the force; here shear gives all back")
    if card.coupling_membrane or card.coupling_bending:
        found.append(f"coupling of warp and weft: {card.coupling_membrane:.3g} N/mm of membrane")
    if np.any(card.in_plane):
        found.append("bending of yarns in the plane: {:.3g} and {:.3g} N mm".format(*card.in_plane))
    return found


def _of_tools(rig: FormingTest) -> list[str]:
    found = [
        "tools: triangles for the laboratory's exact surfaces; the target's own penalty",
        "weight: forces on nodes, which stay on them; contact of all parts has one thickness",
    ]
    if rig.tools.holder is not None:
        drag = rig.rig.holder.drag_per_ms
        found.append(f"holder: drag of {drag:g} / ms on it; here it has the damping of all nodes")
    return found


def write_deck(path: Path, run: Run, prepared: Prepared) -> list[str]:
    """Write the deck of ``prepared`` to ``path``; returns what it does not express.

    Raises :class:`InputError` for a test that decks are not written of, :class:`ResourceError` if the file cannot be
    written. Clamps the model: it is not to be run any more.
    """
    deck, missing = deck_of(run, prepared)
    write_atomic(path, deck.text())
    return missing


def deck_of(run: Run, prepared: Prepared) -> tuple[KeywordFile, list[str]]:
    """The deck itself, and what it does not express; see :func:`write_deck`."""
    if not kinds()[run.rig.kind].deck_force:
        known = ", ".join(name for name, kind in kinds().items() if kind.deck_force)
        raise InputError(f"deck of {run.rig.kind}: expected one of {known}")
    missing = not_expressed(run, prepared)
    deck, model, rig = KeywordFile(), prepared.model, prepared.rig
    dt = run.solver.safety * model.critical_step
    _add_head(deck, run, prepared, missing)
    _add_control(deck, run, rig.duration)
    boundary = Boundary(model, dt)
    if isinstance(model, YarnModel):
        yarns = add_yarns(deck, model)
        rig.constrain(boundary)
        _touch_yarns(deck, run, prepared, boundary, yarns)
    else:
        assert isinstance(model, FabricModel)
        fabric = add_sheet(deck, model)
        rig.constrain(boundary)
        _touch_sheet(deck, run, prepared, boundary, fabric)
    add_motions(deck, model, boundary.drive(), boundary.tables, rig.duration)
    return deck, missing


def _add_head(deck: KeywordFile, run: Run, prepared: Prepared, missing: list[str]) -> None:
    deck.comment(
        f"{run.rig.kind}{' ' + run.direction if run.direction else ''}, {run.fabric.name}, {run.model.scale}, by "
        f"knittest {knittest.__version__}",
        *size_of(run),
        f"{len(prepared.model.mesh.cells)} elements; the laboratory's step "
        f"{1e3 * run.solver.safety * prepared.model.critical_step:.4g} us, its duration {prepared.duration:.6g} ms",
        "",
        "NOT RUN IN A SOLVER: the deck was parsed back and compared with the model, nothing more.",
        "",
        "Units: mm, ms, g; so N, MPa, mJ.",
        f"Force of the test: {kinds()[run.rig.kind].deck_force}.",
        "",
        "Not expressed, or otherwise than in the laboratory:",
        *(f"  - {text}" for text in missing),
    )
    deck.keyword("TITLE", f"{run.rig.kind} of {run.fabric.name}, {run.model.scale}: not run in a solver")


def _add_control(deck: KeywordFile, run: Run, end: float) -> None:
    """Add duration, step, damping and output."""
    sample, frame = end / run.output.samples, end / max(run.output.frames, 1)
    deck.keyword("CONTROL_TERMINATION")
    deck.card("endtim endcyc dtmin endeng endmas nosol", end, 0, 0.0, 0.0, 1e8, 0)
    deck.keyword("CONTROL_TIMESTEP")
    deck.card("dtinit tssfac isdo tslimt dt2ms lctm erode ms1st", 0.0, run.solver.safety, 0, 0.0, 0.0, 0, 0, 0)
    deck.keyword("CONTROL_ENERGY")
    deck.card("hgen rwen slnten rylen", 2, 2, 2, 2)
    if run.solver.damping_per_ms > 0.0:
        deck.keyword("DAMPING_GLOBAL")
        deck.card("lcid valdmp stx sty stz srx sry srz", 0, run.solver.damping_per_ms, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    for name in ("GLSTAT", "MATSUM", "BNDOUT", "SPCFORC", "RCFORC", "SLEOUT"):
        deck.keyword(f"DATABASE_{name}")
        deck.card("dt binary lcur ioopt", sample, 0, 0, 1)
    deck.keyword("DATABASE_BINARY_D3PLOT")
    deck.card("dt lcdt beam npltc psetid", frame, 0, 0, 0, 0)


def _touch_yarns(deck: KeywordFile, run: Run, prepared: Prepared, boundary: Boundary, yarns: YarnParts) -> None:
    model, rig = prepared.model, prepared.rig
    assert isinstance(model, YarnModel)
    if model.contact:
        law = Rubbing(model.group.law.static, model.group.law.kinetic)
        bending = add_part_set(deck, "yarns, bending", yarns.parts)
        add_within(deck, "AUTOMATIC_GENERAL", "yarns with yarns", bending, law, model.pressed)
    if isinstance(rig, FormingTest):
        tools = add_tools(deck, rig, boundary, rig.duration, 2 * len(model.mesh.cells) + 1)
        for part, system, radius in zip(yarns.parts, yarns.systems, yarns.radius, strict=True):
            _touch_tools(deck, "AUTOMATIC_NODES_TO_SURFACE", rig, (part, system), tools, 2.0 * radius)


def _touch_sheet(deck: KeywordFile, run: Run, prepared: Prepared, boundary: Boundary, fabric: int) -> None:
    model, rig = prepared.model, prepared.rig
    assert isinstance(model, FabricModel)
    if model.tracker is not None:
        friction = run.fabric.macro.self_friction.value
        parts = add_part_set(deck, "fabric", [fabric])
        add_within(deck, "AUTOMATIC_SINGLE_SURFACE", "fabric with itself", parts, Rubbing(friction, friction))
    if isinstance(rig, FormingTest):
        tools = add_tools(deck, rig, boundary, rig.duration, len(model.mesh.cells) + 1)
        thickness = 2.0 * float(model.mesh.radius[0])
        _touch_tools(deck, "AUTOMATIC_SURFACE_TO_SURFACE", rig, (fabric, "fabric"), tools, thickness)


def _touch_tools(
    deck: KeywordFile, kind: str, rig: FormingTest, of: tuple[int, str], tools: list[int], thickness: float
) -> None:
    law = Rubbing(rig.rig.static_coefficient, rig.rig.kinetic_coefficient, TOOL_DAMPING)
    names = [*rig.tools.by_name, "floor"]
    for name, tool in zip(names, tools, strict=False):
        add_with_tool(deck, kind, f"{of[1]} with {name}", of[0], tool, law, thickness)
