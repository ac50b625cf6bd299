"""Lumped masses of chains and their critical step, with mass scaling."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.rounding import rounded_down
from knittest.kernels.beam import rotary_inertia_factor
from knittest.models.chain_layout import Layout
from knittest.models.yarn_contact import YarnContact
from knittest.models.yarn_step import nodal_loads

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: row of the bound by nodes over the penalty, for contacts on a node within a chain and on its end: weights w >= 0 add
#: 2 k w, of contacts one element apart at most 2 k. Half an element beyond its centre-line a yarn's end keeps a contact
#: with weights 9/8, -1/4 and 1/8: k (1 + 3/2) 9/8
CONTACT_STEP_SHARE, END_STEP_SHARE = 2.0, 45.0 / 16.0
#: share of the largest squared frequency of a model that resistance of its crossings to spin may add to it
SPIN_STEP_SHARE = 0.05


@dataclass(frozen=True)
class MassScaling:
    """Critical step [ms] to scale nodal masses to, before the ``safety`` factor, and the largest added share [-]."""

    step: float
    most: float
    safety: float = 1.0


def lump(lay: Layout) -> tuple[Array, Array]:
    """Nodal mass [g] and rotary inertia [g mm^2]."""
    stretch = np.array([c.stretch for c in lay.chains])[lay.chain]
    half = np.where(lay.joined, 0.5 * lay.of_card("linear_density") * lay.length * stretch, 0.0)
    mass = half.copy()
    mass[1:] += half[:-1]
    spread = np.empty(len(half))
    for s, card in enumerate(lay.cards):
        of = (lay.section == s) & lay.joined
        bending = max(card.bending, card.across or 0.0)
        alpha = rotary_inertia_factor(card.axial, card.shear, card.torsion, bending, lay.mean_length(s))
        spread[lay.section == s] = alpha * float(lay.length[of].max()) ** 2 if of.any() else 1.0
    return mass, spread * mass


def _loads(lay: Layout, mass: Array, inertia: Array, contact: YarnContact | None) -> Array:
    """Largest stiffness [N/mm] that each node feels, see :func:`nodal_loads`."""
    share = np.where(lay.inner(), CONTACT_STEP_SHARE, END_STEP_SHARE)
    radius, wide = lay.of_card("radius"), lay.of_card("wide")
    turns = mass / inertia
    # a force along the normal of an ellipse turns it by its shift, at most the difference of its half axes
    touch = contact.stiffest(float(radius.min())) * (1.0 + (wide - radius) ** 2 * turns) if contact else 0.0
    # sticking turns a node by its arm too, and the rotary inertia is mass times inertia / mass
    stick = contact.tangential * (1.0 + wide**2 * turns) if contact else np.zeros(len(mass))
    axial, shear = (lay.of_card(name) / lay.rest for name in ("axial", "shear"))
    return nodal_loads(lay.chord, lay.joined, axial, shear, share * np.maximum(touch, stick), share * stick)


def scale_mass(
    lay: Layout,
    mass: Array,
    inertia: Array,
    contact: YarnContact | None,
    scaling: MassScaling | None,
) -> tuple[float, Array, Array, float, float]:
    """Critical step [ms] by nodes (omega^2 <= load / m), masses for it, the share added, and the stiffness of crossings
    against spin [N mm/rad].

    That of the nodes within the chains, for which ends in contact are made heavy enough, or the target of ``scaling``.
    """
    load = _loads(lay, mass, inertia, contact)
    inner = lay.inner() if contact is not None and lay.inner().any() else np.full(len(mass), True)
    torsional = 0.0 if contact is None else contact.torsional(_bearable(load, mass, inertia, inner, scaling))
    # the largest frequencies of two sets of springs, squared, are no more than those of both together
    load = load + np.where(lay.inner(), CONTACT_STEP_SHARE, END_STEP_SHARE) * torsional * mass / inertia
    steps = 2.0 * np.sqrt(mass / load)
    step = float(steps[inner].min()) if scaling is None else scaling.step
    scaled = np.maximum(mass, 0.25 * step**2 * load)
    added = float(scaled.sum() / mass.sum() - 1.0)
    if scaling is not None and added > scaling.most:
        longest = 1e3 * scaling.safety * longest_step(load, mass, scaling.most, step)
        raise InputError(
            f"solver.target_step adds {100 * added:.1f} % mass, more than solver.max_added_mass = "
            f"{100 * scaling.most:g} %; the unscaled critical step is {1e3 * steps[inner].min():.4f} us; "
            f"solver.target_step={rounded_down(longest):g} would pass"
        )
    return step, scaled, inertia * scaled / mass, added, torsional


def _bearable(load: Array, mass: Array, inertia: Array, inner: Flags, scaling: MassScaling | None) -> float:
    """Stiffness against spin [N mm/rad] that adds :data:`SPIN_STEP_SHARE` to the largest squared frequency."""
    largest = float((load / mass)[inner].max()) if scaling is None else 4.0 / scaling.step**2
    turned = inertia * np.maximum(load / (mass * largest), 1.0)
    return SPIN_STEP_SHARE * largest * float(turned.min()) / CONTACT_STEP_SHARE


def longest_step(load: Array, mass: Array, most: float, too_long: float) -> float:
    """Step [ms], below one that is ``too_long``, to which nodes of ``mass`` [g] under ``load`` [N/mm], (n,), can be
    scaled with a share of ``most`` [-] added; by bisection.
    """
    low, high = 0.0, too_long
    for _ in range(50):
        middle = 0.5 * (low + high)
        fits = float(np.maximum(mass, 0.25 * middle**2 * load).sum() / mass.sum() - 1.0) <= most
        low, high = (middle, high) if fits else (low, middle)
    return low
