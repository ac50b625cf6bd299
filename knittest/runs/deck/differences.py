"""Differences between a model and its deck for another solver, as its head and the command state them."""

from typing import Literal

import numpy as np

from knittest.base.errors import InputError
from knittest.config.run import Run
from knittest.kernels.shell_state import Laminate
from knittest.laboratory.base import PreparedSpecimen
from knittest.laboratory.forming.rig import FormingTest
from knittest.models.fabric_model import FabricModel
from knittest.models.yarn_model import YarnModel
from knittest.runs.deck.yarn_sections import AXIAL_SHARE, MASS_SHARE

Solver = Literal["ls-dyna", "openradioss"]

BROKEN = {
    "ls-dyna": "a broken cable leaves its beam: {share:g} % of the axial stiffness, full bending stiffness",
    "openradioss": "the force of a cable falls to zero where it breaks; its beam fails at the same axial strain, and "
    "its force falls to zero over about ten steps; their contact is removed",
}
CONTACT = {
    "ls-dyna": (
        "penalty stiffness of contact, {law.normal:g} N/mm, and sticking, {law.tangential:g} N/mm: by the solver",
    ),
    "openradioss": (
        "penalty stiffness of contact: {law.normal:g} N/mm as in the model, for each pair of segments, and rising with "
        "depth; that of sticking, {law.tangential:g} N/mm, by the solver",
        "a yarn does not touch itself; yarns of one system touch the next ones only",
        "overlaps at the start: removed, the gap is shorter there",
    ),
}
STRESS = {
    "ls-dyna": "stress: curves are force per reference width and thickness; the solver takes them as true stress, "
    "which differs by the strain and by the area lost in shear (13 % at 30 deg)",
    "openradioss": "stress: curves of tension are force per reference width and thickness, as the solver takes them; "
    "it takes that of shear as true stress, which differs by the area lost in shear (13 % at 30 deg)",
}


def deck_differences(run: Run, prepared: PreparedSpecimen, solver: Solver = "ls-dyna") -> list[str]:
    """Differences between the model of ``run`` and its deck for ``solver``, with their numbers."""
    model = prepared.model
    if isinstance(model, YarnModel):
        if model.soft_contact is not None:
            raise InputError("fabric.knitting.soft_shell: a deck cannot hold this contact; use --scale macro")
        found = _yarn_differences(run, model, solver)
    else:
        assert isinstance(model, FabricModel)
        found = _shell_differences(model.laminate, solver)
        if model.tracker is not None and solver == "openradioss":
            found.append("contact of the fabric with itself: left out")
    if isinstance(prepared.rig, FormingTest):
        found += _tool_differences(prepared.rig)
    else:
        found.append("end of the test: at the largest strain or angle, not when the force has dropped")
    if (many := run.variability.specimens) > 1:
        found.append(f"ensemble: this is the first of {many} specimens")
    return [*found, "quality checks: the user must check energies and penetration"]


def _yarn_differences(run: Run, model: YarnModel, solver: Solver) -> list[str]:
    law, beams, share = model.group.law, model.beams, 100 * AXIAL_SHARE
    found = [
        f"yarns in compression, or in tension within their slack: {share:g} % of the axial stiffness",
        BROKEN[solver].format(share=share),
        "yarns: rigid in transverse shear; rotary inertia by the solver",
        f"mass: {100 * MASS_SHARE:g} % on beams, the rest on cables, spread evenly over each part",
    ]
    if model.added_mass > 0.0:
        found.append(f"mass scaling: the added {100 * model.added_mass:.3g} % are spread evenly over a yarn system")
    if model.contact:
        found += [
            "contact: between straight segments, not between smooth centre-lines",
            *(text.format(law=law) for text in CONTACT[solver]),
        ]
        if law.static > law.kinetic and solver == "openradioss":
            found.append(f"friction: {law.kinetic:g} also before yarns slip, not {law.static:g}")
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


def _shell_differences(card: Laminate, solver: Solver) -> list[str]:
    fails = (
        f"; the model deletes shell elements at fibre strains of {100 * card.fail_strain[0]:.4g} % (warp) and "
        f"{100 * card.fail_strain[1]:.4g} % (weft)"
    )
    found = [
        f"failure: none{fails if np.isfinite(card.fail_strain).all() else ''}",
        STRESS[solver],
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
