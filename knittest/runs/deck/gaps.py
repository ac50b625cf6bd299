"""Gaps of a deck: what it does not express of its run, as sentences for its head."""

import numpy as np

from knittest.config.run import Run
from knittest.kernels.shell_state import Laminate
from knittest.laboratory.base import Prepared
from knittest.laboratory.forming.rig import FormingTest
from knittest.models.fabric_model import FabricModel
from knittest.models.yarn_model import YarnModel
from knittest.runs.deck.yarns import AXIAL_SHARE, MASS_SHARE


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
