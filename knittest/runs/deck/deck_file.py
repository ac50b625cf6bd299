"""Writes a prepared specimen as a deck of LS-DYNA keywords.

Strips were run in OpenRadioss after a conversion; no deck was run in LS-DYNA.
"""

from pathlib import Path

import knittest
from knittest.base.errors import InputError
from knittest.base.files import write_atomic
from knittest.base.kinds import kinds
from knittest.config.run import Run
from knittest.export.keywords import KeywordFile
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
from knittest.runs.deck.differences import Solver, deck_differences


def write_deck(path: Path, run: Run, prepared: PreparedSpecimen) -> list[str]:
    """Write the deck of ``prepared`` to ``path``; returns its differences from the model.

    Raises :class:`InputError` for a test without deck, :class:`ResourceError` if the file cannot be written. Clamps the
    model, which must not be run afterwards.
    """
    deck, missing = deck_of(run, prepared)
    write_atomic(path, deck.text())
    return missing


def check_test(run: Run, solver: Solver) -> None:
    """Raise :class:`InputError` if the test of ``run`` has no deck for ``solver``."""
    part = "deck_force" if solver == "ls-dyna" else "deck_curve"
    known = [name for name, kind in kinds().items() if getattr(kind, part)]
    if run.rig.kind not in known:
        raise InputError(f"deck of {run.rig.kind} for {solver}: not supported; expected one of {', '.join(known)}")


def deck_of(run: Run, prepared: PreparedSpecimen) -> tuple[KeywordFile, list[str]]:
    """The deck and its differences from the model; see :func:`write_deck`."""
    check_test(run, "ls-dyna")
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


def head_lines(
    run: Run, prepared: PreparedSpecimen, missing: list[str], known: tuple[str, ...], force: str
) -> list[str]:
    """Lines at the head of a deck: test, size, what is ``known`` of such decks, units, ``force``, differences."""
    return [
        f"{run.rig.kind}{' ' + run.direction if run.direction else ''}, {run.fabric.name}, {run.model.scale}, by "
        f"knittest {knittest.__version__}",
        *size_of(run),
        f"{len(prepared.model.mesh.cells)} elements; time step in knittest "
        f"{1e3 * run.solver.safety * prepared.model.critical_step:.4g} us, duration {prepared.duration:.6g} ms",
        "",
        *known,
        "",
        "Units: mm, ms, g; so N, MPa, mJ.",
        f"Force of the test: {force}.",
        "",
        "Differences from the model in knittest:",
        *(f"  - {text}" for text in missing),
    ]


#: what is known of decks for LS-DYNA
KNOWN = (
    "NOT RUN IN LS-DYNA. Decks of this format ran in OpenRadioss after a conversion by another program: strips of",
    "shells and of yarns. This file was parsed back and compared with the model.",
)


def _add_head(deck: KeywordFile, run: Run, prepared: PreparedSpecimen, missing: list[str]) -> None:
    deck.comment(*head_lines(run, prepared, missing, KNOWN, kinds()[run.rig.kind].deck_force))
    deck.keyword("TITLE", f"{run.rig.kind} of {run.fabric.name}, {run.model.scale}: not run in LS-DYNA")


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
