"""Writes a prepared specimen as a deck of LS-DYNA keywords. None has been run in that solver by its authors."""

from pathlib import Path

import knittest
from knittest.base.atomic import write_atomic
from knittest.base.errors import InputError
from knittest.base.kinds import kinds
from knittest.config.run import Run
from knittest.export.keywords import KeywordFile
from knittest.laboratory.base import Prepared
from knittest.laboratory.forming.rig import FormingTest
from knittest.laboratory.run_stamp import size_of
from knittest.models.boundary import TOOL_DAMPING, Boundary
from knittest.models.fabric_model import FabricModel
from knittest.models.yarn_model import YarnModel
from knittest.runs.deck.contact import Rubbing, add_part_set, add_with_tool, add_within
from knittest.runs.deck.gaps import not_expressed
from knittest.runs.deck.motions import add_motions
from knittest.runs.deck.sheet import add_sheet
from knittest.runs.deck.tools import add_tools
from knittest.runs.deck.yarns import YarnParts, add_yarns


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
