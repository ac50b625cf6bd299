"""Writes a prepared specimen as a deck of LS-DYNA keywords; no deck has been run in that solver by its authors."""

from pathlib import Path

import numpy as np

import knittest
from knittest.base.errors import InputError
from knittest.base.files import write_atomic
from knittest.base.kinds import kinds
from knittest.config.run import Run
from knittest.export.keywords import KeywordFile
from knittest.kernels.shell_state import Laminate
from knittest.laboratory.base import PreparedSpecimen
from knittest.laboratory.forming.rig import FormingTest
from knittest.laboratory.report_base import size_of
from knittest.models.boundary import TOOL_DAMPING, Boundary
from knittest.models.fabric_model import FabricModel
from knittest.models.yarn_model import YarnModel
from knittest.runs.deck.beam_parts import add_yarns
from knittest.runs.deck.deck_parts import (
    IGNORE_OPTION,
    PART,
    PART_SET,
    SEEN,
    FrictionLaw,
    Part,
    add_block,
    add_contact,
    add_motions,
    add_set,
    add_sheet,
    add_tools,
)
from knittest.runs.deck.yarn_sections import AXIAL_SHARE, MASS_SHARE


def deck_differences(run: Run, prepared: PreparedSpecimen) -> list[str]:
    """Differences between the model of ``run`` and its deck, with their numbers."""
    model = prepared.model
    if isinstance(model, YarnModel):
        found = _yarn_differences(run, model)
    else:
        assert isinstance(model, FabricModel)
        found = _shell_differences(model.laminate)
    if isinstance(prepared.rig, FormingTest):
        found += _tool_differences(prepared.rig)
    else:
        found.append("end of the test: at the largest strain or angle, not when the force has dropped")
    if (many := run.variability.specimens) > 1:
        found.append(f"ensemble: this is the first of {many} specimens")
    return [*found, "quality checks: the user must check energies and penetration"]


def _yarn_differences(run: Run, model: YarnModel) -> list[str]:
    law, beams = model.group.law, model.beams
    found = [
        f"yarns in compression, or in tension within their slack: {100 * AXIAL_SHARE:g} % of the axial stiffness",
        f"a broken cable leaves its beam: {100 * AXIAL_SHARE:g} % of the axial stiffness, full bending stiffness",
        "yarns: rigid in transverse shear; rotary inertia by the solver",
        f"mass: {100 * MASS_SHARE:g} % on beams, the rest on cables, spread evenly over each part",
    ]
    if model.added_mass > 0.0:
        found.append(f"mass scaling: the added {100 * model.added_mass:.3g} % are spread evenly over a yarn system")
    if model.contact:
        found += [
            "contact: between straight segments, not between smooth centre-lines",
            f"penalty stiffness of contact, {law.normal:g} N/mm, and sticking, {law.tangential:g} N/mm: by the solver",
        ]
        if law.linear or law.square or law.cubic:
            found.append("compaction of yarns: contact stiffness does not rise with depth")
        if law.torsional:
            found.append(f"friction against spin at crossings, up to {law.torsional:.3g} N mm/rad: left out")
    card = run.fabric.knitting
    if model.prestressed and card.degree_of_set.value < 1.0:
        found.append(f"degree of set of the loops: 1, not {card.degree_of_set.value:g} as in the model")
    if card.loop_shortening_fraction:
        found.append(
            f"loop shortening of {100 * card.loop_shortening_fraction:g} %, with its initial tension: left out"
        )
    if card.loop_scatter != "none":
        found.append("scatter of the loop length between courses: left out")
    if model.pressed:
        found.append("initial equilibrium of overlapping yarns: left out; the deck starts out of equilibrium")
    if np.isinf(beams.fail_strain[model.element_node]).all():
        found.append("failure: the yarns of this run do not fail")
    return found


def _shell_differences(card: Laminate) -> list[str]:
    fails = (
        f"; the model deletes shell elements at fibre strains of {100 * card.fail_strain[0]:.4g} % (warp) and "
        f"{100 * card.fail_strain[1]:.4g} % (weft)"
    )
    found = [
        f"failure: none{fails if np.isfinite(card.fail_strain).all() else ''}",
        "stress: curves are force per reference width and thickness; the solver takes them as true stress, which "
        "differs by the strain and by the area lost in shear (13 % at 30 deg)",
        "twisting stiffness: from layers at their offset, not at half the thickness",
        "hourglass control: none, the shell elements are fully integrated",
    ]
    if card.shear_friction:
        found.append(f"friction in shear, {100 * card.shear_friction:g} % of the force: left out, shear is elastic")
    if card.coupling_membrane or card.coupling_bending:
        found.append(f"coupling of warp and weft, {card.coupling_membrane:.3g} N/mm in the membrane: left out")
    if card.energy is not None:
        found.append("law of two strains: left out, curves are those of strips with free sides")
    if np.any(card.in_plane):
        found.append("in-plane bending stiffness, {:.3g} and {:.3g} N mm: left out".format(*card.in_plane))
    return found


def _tool_differences(rig: FormingTest) -> list[str]:
    found = [
        "tools: triangles, not exact surfaces; penalty stiffness by the solver",
        "weight: constant forces on nodes; contact: one thickness for each part",
    ]
    if rig.tools.holder is not None:
        drag = rig.rig.holder.damping_rate_per_ms
        found.append(f"holder: damped like all nodes, not by its damping rate of {drag:g} / ms")
    return found


def write_deck(path: Path, run: Run, prepared: PreparedSpecimen) -> list[str]:
    """Write the deck of ``prepared`` to ``path``; returns its differences from the model.

    Raises :class:`InputError` for a test without deck, :class:`ResourceError` if the file cannot be written. Clamps the
    model, which must not be run afterwards.
    """
    deck, missing = deck_of(run, prepared)
    write_atomic(path, deck.text())
    return missing


def deck_of(run: Run, prepared: PreparedSpecimen) -> tuple[KeywordFile, list[str]]:
    """The deck and its differences from the model; see :func:`write_deck`."""
    if not kinds()[run.rig.kind].deck_force:
        known = ", ".join(name for name, kind in kinds().items() if kind.deck_force)
        raise InputError(f"deck of {run.rig.kind}: not supported; expected one of {known}")
    missing = deck_differences(run, prepared)
    deck, model, rig = KeywordFile(), prepared.model, prepared.rig
    dt = run.solver.safety * model.critical_step
    _add_head(deck, run, prepared, missing)
    _add_control(deck, run, rig.duration)
    boundary = Boundary(model, dt)
    if isinstance(model, YarnModel):
        parts, to_tools = add_yarns(deck, model), "AUTOMATIC_NODES_TO_SURFACE"
    else:
        assert isinstance(model, FabricModel)
        parts, to_tools = [add_sheet(deck, model)], "AUTOMATIC_SURFACE_TO_SURFACE"
    rig.constrain(boundary)
    _add_self_contact(deck, run, model, parts)
    if isinstance(rig, FormingTest):
        first = (2 if isinstance(model, YarnModel) else 1) * len(model.mesh.cells) + 1
        tools = add_tools(deck, rig, boundary, rig.duration, first)
        law = FrictionLaw(rig.rig.static_coefficient, rig.rig.kinetic_coefficient, TOOL_DAMPING)
        for part in parts:
            for name, tool in zip([*rig.tools.by_name, "floor"], tools, strict=False):
                surfaces = (part.number, tool, PART, PART)
                add_contact(deck, to_tools, f"{part.name} with {name}", surfaces, law, (part.thickness, SEEN))
    add_motions(deck, model, boundary.drive(), boundary.tables, rig.duration, run.solver.damping_per_ms)
    return deck, missing


def _add_head(deck: KeywordFile, run: Run, prepared: PreparedSpecimen, missing: list[str]) -> None:
    deck.comment(
        f"{run.rig.kind}{' ' + run.direction if run.direction else ''}, {run.fabric.name}, {run.model.scale}, by "
        f"knittest {knittest.__version__}",
        *size_of(run),
        f"{len(prepared.model.mesh.cells)} elements; time step in knittest "
        f"{1e3 * run.solver.safety * prepared.model.critical_step:.4g} us, duration {prepared.duration:.6g} ms",
        "",
        "NOT RUN IN A SOLVER: the deck was only parsed back and compared with the model.",
        "",
        "Units: mm, ms, g; so N, MPa, mJ.",
        f"Force of the test: {kinds()[run.rig.kind].deck_force}.",
        "",
        "Differences from the model in knittest:",
        *(f"  - {text}" for text in missing),
    )
    deck.keyword("TITLE", f"{run.rig.kind} of {run.fabric.name}, {run.model.scale}: not run in a solver")


def _add_control(deck: KeywordFile, run: Run, end: float) -> None:
    sample, frame = end / run.output.samples, end / max(run.output.frames, 1)
    add_block(deck, "CONTROL_TERMINATION", "endtim endcyc dtmin endeng endmas nosol", end, 0, 0.0, 0.0, 1e8, 0)
    deck.keyword("CONTROL_TIMESTEP")
    deck.card("dtinit tssfac isdo tslimt dt2ms lctm erode ms1st", 0.0, run.solver.safety, 0, 0.0, 0.0, 0, 0, 0)
    add_block(deck, "CONTROL_ENERGY", "hgen rwen slnten rylen", 2, 2, 2, 2)
    if run.solver.damping_per_ms > 0.0:
        deck.keyword("DAMPING_GLOBAL")
        deck.card("lcid valdmp stx sty stz srx sry srz", 0, run.solver.damping_per_ms, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    for name in ("GLSTAT", "MATSUM", "BNDOUT", "SPCFORC", "RCFORC", "SLEOUT"):
        add_block(deck, f"DATABASE_{name}", "dt binary lcur ioopt", sample, 0, 0, 1)
    deck.keyword("DATABASE_BINARY_D3PLOT")
    deck.card("dt lcdt beam npltc psetid", frame, 0, 0, 0, 0)


def _add_self_contact(deck: KeywordFile, run: Run, model: YarnModel | FabricModel, parts: list[Part]) -> None:
    numbers = [part.number for part in parts]
    if isinstance(model, YarnModel):
        if model.contact:
            law = FrictionLaw(model.group.law.static, model.group.law.kinetic)
            surfaces = (add_set(deck, "part", "yarns, bending", numbers), 0, PART_SET, 0)
            ignore = 0 if model.pressed else IGNORE_OPTION
            add_contact(deck, "AUTOMATIC_GENERAL", "yarns with yarns", surfaces, law, ignore=ignore)
    elif model.tracker is not None:
        friction = run.fabric.macro.self_friction.value
        surfaces = (add_set(deck, "part", "fabric", numbers), 0, PART_SET, 0)
        law = FrictionLaw(friction, friction)
        add_contact(deck, "AUTOMATIC_SINGLE_SURFACE", "fabric with itself", surfaces, law)
