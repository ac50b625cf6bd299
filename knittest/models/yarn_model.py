"""Beam chains with yarn contact as a model of the explicit driver, and the faults that make it unusable: a collapsed
beam, one whose sections turn against its axis, a yarn that passes another.
"""

from dataclasses import dataclass, field

import numpy as np
from numba import get_num_threads

from knittest.base.arrays import Array, Flags, Index
from knittest.base.history import Overlaps
from knittest.kernels import monitor
from knittest.kernels.contact import SIDE_BY_SIDE, spline_weights
from knittest.kernels.explicit import advance_yarns, advance_yarns_alone
from knittest.kernels.state import Beams, ContactLaw, Drive, Images, Partitions, Tally
from knittest.models.contact_tracker import LEAST_STEPS, ContactTracker, YarnContactGroup
from knittest.models.explicit_model import (
    ExplicitModel,
    State,
    StoredEnergies,
    arrays_of,
    put_back,
    with_prefix,
    without_prefix,
)
from knittest.models.natural_state import check_conformity, shape_energy
from knittest.models.sections import beam_resultants
from knittest.models.soft_contact import SoftTracker

NO_CONTACT = ContactLaw(0.0, 0.0, 0.0, 0.0, 0.0)
#: arrays of the beams that a run changes
CHANGING = ("alive", "fail_time")
#: mechanisms by which beams store energy; that of transverse shear, which bending needs, is with bending
MECHANISMS = ("stretching", "bending", "torsion")
#: length over rest length below which a beam has collapsed
SHORTEST = 0.1
#: distance of the centre-lines of a crossing over its reach below which one yarn is about to pass the other
NEAREST = 0.1


def section_of_nodes(parts: Partitions, n: int) -> Index:
    """Beam section of each of ``n`` nodes."""
    section = np.zeros(n, np.int64)
    for first, stop, number in parts.span:
        section[first:stop] = number
    return section


def _stiffness(parts: Partitions, beams: Beams) -> tuple[Array, Array]:
    """Largest axial and the shear stiffness of every living beam [N/mm], (n_nodes,) each, 0 where there is none."""
    tangent = np.maximum(beams.stiffness[:, 0], np.cumsum(beams.hinge_slope, axis=1).max(axis=1))
    axial, shear = np.zeros(beams.alive.size), np.zeros(beams.alive.size)
    for start, stop, section in parts.span:
        if section >= 0:
            living = np.where(beams.alive[start:stop] > 0.0, beams.inv_length[start:stop], 0.0)
            axial[start:stop], shear[start:stop] = tangent[section] * living, beams.stiffness[section, 1] * living
    return axial, shear


@dataclass
class YarnModel(ExplicitModel):
    """``element_node`` (n_el,) first node of each element of the mesh; ``section_part`` (n_sections,) part of each beam
    section; ``contact`` False leaves yarns blind; ``prestressed`` if yarns are bent or under tension in their start
    shape, or press each other there; ``images`` of its nodes in a periodic cell, else None.
    """

    beams: Beams
    element_node: Index
    section_part: Index
    group: YarnContactGroup
    contact: bool = True
    prestressed: bool = False
    images: Images | None = None
    tracker: ContactTracker = field(init=False)

    def __post_init__(self) -> None:
        tracker = ContactTracker if self.group.soft_law is None else SoftTracker
        self.tracker = tracker(self.nodes, self.beams.alive, self.group, self.name_of)
        self.law = self.group.law if self.contact else NO_CONTACT
        self.axial_stiffness, self.shear_stiffness = _stiffness(self.parts, self.beams)
        self.node_load = np.zeros((self.n_nodes, 6))
        # both yarns of a crossing may move, and contacts are looked at every LEAST_STEPS steps at the latest
        self.farthest = float(self.group.radius.min()) / LEAST_STEPS
        self.pressed = self.contact and self.group.pressed
        self.compliant = self.contact and self.group.compliant
        self.prestressed |= self.pressed
        self.flattens = self.group.shape.size > 0

    @property
    def soft_contact(self) -> SoftTracker | None:
        """Contact of yarns with a soft shell; None where yarns touch by the penalty or not at all."""
        return self.tracker if self.contact and isinstance(self.tracker, SoftTracker) else None

    def prepare(self) -> Overlaps:
        """See :meth:`ContactTracker.settle`; overlaps that press are none that is free of force."""
        found = self.tracker.settle() if self.contact else Overlaps()
        return Overlaps() if self.pressed else found

    def safe_steps(self, dt: float, most: int, speed: float = 0.0) -> int:
        """See :meth:`ContactTracker.safe_steps`."""
        return self.tracker.safe_steps(dt, most, speed) if self.contact else most

    def advance(self, steps: int, time: float, dt: float, drive: Drive, tally: Tally, scratch: Array) -> None:
        """Renew contacts that may come near, then advance."""
        if self.contact:
            given, late = self.tracker.update(steps * dt)
            tally.energy[0, 7] += given
            tally.late[0] = max(tally.late[0], late)
        self.step(steps, time, dt, drive, tally, scratch)

    def step(self, steps: int, time: float, dt: float, drive: Drive, tally: Tally, scratch: Array) -> None:
        """See :meth:`ExplicitModel.step`."""
        soft = (None, None) if self.soft_contact is None else (self.soft_contact.pairs, self.soft_contact.law)
        arguments = (
            steps, time, dt, self.nodes, self.parts, self.beams, self.tracker.contacts, self.tracker.count, self.law,
            *soft, self.law.spin, True if self.group.excess.size else None, self.images,
            *self.kernel_drive(drive), tally, scratch,
        )  # fmt: skip
        if (threads := get_num_threads()) > 1:
            advance_yarns(threads, *arguments)
        else:
            advance_yarns_alone(*arguments)

    def stored_energies(self) -> StoredEnergies:
        """Energies of the living beams by yarn system and of the contacts."""
        contact, penetration = monitor.contact_statistics(
            self.tracker.contacts, self.tracker.count, self.law, self.group.radius
        )
        if self.soft_contact is not None:
            contact, penetration = self.soft_contact.stored()
        found = self.beam_energies()
        internal = np.sum(list(found.values()), axis=0)
        contact += shape_energy(self.group.shape, self.beams, self.counted_beams(), self.group.owned)
        return StoredEnergies(internal, contact, 0.0, penetration, found, force_free=self.force_free())

    def beam_energies(self) -> dict[str, Array]:
        """Energies [mJ] of the living beams of each part, (n_parts,), by :data:`MECHANISMS`."""
        sections = monitor.section_energies(self.nodes, self.parts, self.beams._replace(alive=self.counted_beams()))
        n_parts = len(self.mesh.part_names)
        return {
            name: np.bincount(self.section_part, energy, n_parts).astype(float)
            for name, energy in zip(MECHANISMS, sections.T, strict=True)
        }

    def counted_beams(self) -> Array:
        """Living beams, (n_nodes + 1,): 1 where their energy counts, else 0."""
        return self.beams.alive

    def force_free(self) -> tuple[float, float]:
        """Deepest overlap that carries no force over the smaller radius, away from the ends of yarns and at them."""
        if not self.contact:
            return 0.0, 0.0
        share, at_ends = self.tracker.force_free(), self.tracker.end_flags()
        return float(share[~at_ends].max(initial=0.0)), float(share[at_ends].max(initial=0.0))

    def contact_force_sum(self) -> float:
        """See :meth:`ExplicitModel.contact_force_sum`."""
        if self.soft_contact is not None:
            return self.soft_contact.force_sum()
        return float(np.linalg.norm(self.tracker.contacts.force[:, : self.tracker.count], axis=0).sum())

    def largest_force(self) -> float:
        """See :meth:`ExplicitModel.largest_force`."""
        contact = np.linalg.norm(self.tracker.contacts.force[:, : self.tracker.count], axis=0)
        if self.soft_contact is not None:
            contact = np.linalg.norm(self.soft_contact.pairs.force, axis=0)
        axial = monitor.axial_state(self.nodes, self.parts, self.beams)[1]
        return max(float(np.abs(axial).max(initial=0.0)), float(contact.max(initial=0.0)))

    def press(self, most: float) -> float:
        """See :meth:`ExplicitModel.press`."""
        return self.tracker.press(most) if self.pressed else 0.0

    def masters(self) -> Index:
        """Node that every node is, or in a periodic cell is an image of, (n_nodes,)."""
        return np.arange(self.n_nodes)

    def representative_nodes(self) -> Flags:
        """Flags (n_nodes,) of the nodes in the middle third of the piece in each direction, away from its edges."""
        place = self.nodes.position[:2, : self.n_nodes]
        low, high = place.min(axis=1, keepdims=True), place.max(axis=1, keepdims=True)
        return (np.abs(place - 0.5 * (low + high)) <= (high - low) / 6.0).all(axis=0)

    def count_failed(self) -> Index:
        """Broken beams by yarn system."""
        broken = np.isfinite(self.beams.fail_time[self.element_node])
        return np.bincount(self.mesh.part[broken], minlength=len(self.mesh.part_names))

    def fields(self, position: Array | None = None, time: float = np.inf) -> dict[str, Array]:
        """Axial strain [-], axial force [N] and alive flag of every beam; see :meth:`ExplicitModel.fields`."""
        nodes, beams = self.nodes, self.beams
        if position is not None:
            nodes = nodes._replace(position=position)
            beams = beams._replace(alive=(beams.fail_time >= time).astype(float))
        strain, force = monitor.axial_state(nodes, self.parts, beams)[:, self.element_node]
        return {"axial_strain": strain, "axial_force": force, "alive": beams.alive[self.element_node]}

    def resultants(self) -> dict[str, Array]:
        """See :meth:`ExplicitModel.resultants` and :func:`beam_resultants`."""
        element, section = self.element_node, section_of_nodes(self.parts, self.n_nodes)
        return self.fields() | beam_resultants(self.nodes, self.beams, element, section[element])

    def contact_forces(self) -> tuple[Array, Array, Index]:
        """See :meth:`ExplicitModel.contact_forces`."""
        if self.soft_contact is not None:
            return self.soft_contact.contact_forces()
        contacts, count = self.tracker.contacts, self.tracker.count
        touching = np.flatnonzero((contacts.force[:, :count] != 0.0).any(axis=0))
        piece, offset = contacts.piece[:, touching], contacts.offset[:, touching]
        first, at, last = spline_weights.py_func(contacts.parameter[0, touching])
        x = self.nodes.position
        centre = first * x[:, piece[0] - 1] + at * x[:, piece[0]] + last * x[:, piece[0] + 1]
        place = centre - contacts.arm[touching] * offset
        if contacts.shift.size:
            place -= contacts.shift[:, touching]
        return place.T, contacts.force[:, touching].T, self.group.chain[piece].T

    def search_seconds(self) -> float:
        """See :class:`ContactTracker`."""
        return self.tracker.seconds

    def broken_nodes(self, since: float) -> Index:
        """Nodes of all chains with a beam that broke after ``since`` [ms]."""
        time = self.beams.fail_time
        broken = np.unique(self.group.chain[np.isfinite(time) & (time > since)])
        return np.flatnonzero(np.isin(self.group.chain, broken))

    def diagnose(self, dt: float) -> str:
        """Diagnose the present state at time step ``dt`` [ms]; empty if nothing is wrong.

        Raises :class:`InputError` for sections that lie along the loops, see :func:`check_conformity`.
        """
        fault = self.invalid_state(dt)
        if not fault and self.contact:
            check_conformity(self.tracker, self.nodes.position)
        return fault

    def invalid_state(self, dt: float) -> str:
        """Describe a collapsed beam, one whose sections turn, yarns that pass each other, or a node too fast for the
        search of contacts at time step ``dt`` [ms]; empty if there is none.
        """
        if monitor.count_short_beams(self.nodes.position, self.beams.alive, self.beams.inv_length, SHORTEST):
            return self._collapse_fault()
        return self._unstable_section_fault() or (
            (self._piercing_fault() or self._speed_fault(dt)) if self.contact else ""
        )

    def _unstable_section_fault(self) -> str:
        i, ratio = monitor.least_stable_beam(self.nodes, self.parts, self.beams)
        if ratio <= 1.0:
            return ""
        chord = self.nodes.position[:, i + 1] - self.nodes.position[:, i]
        stretch = float(np.linalg.norm(chord)) * float(self.beams.inv_length[i])
        shear = float(self.shear_stiffness[i] / self.beams.inv_length[i])
        tension, limit = ratio * shear * stretch, shear * stretch
        return (
            f"the tension of {self.name_of(i)} (node {i}), {tension:.4g} N at {100 * (stretch - 1):.3g} % strain, "
            f"exceeds GA (1 + e) = {limit:.4g} N: its sections are unstable in shear; use a shear stiffness GA of "
            f"at least {ratio * shear:.4g} N, or in a test a larger rig.membrane_share"
        )

    def _collapse_fault(self) -> str:
        length = np.linalg.norm(np.diff(self.position(), axis=0, append=np.nan), axis=1)
        ratio = np.where(self.beams.alive > 0.0, length * self.beams.inv_length, np.inf)
        i = int(np.nanargmin(ratio))
        return f"a beam of {self.name_of(i)} (node {i}) has collapsed to {100 * ratio[i]:.1f} % of its length"

    def _speed_fault(self, dt: float) -> str:
        step = self.tracker.speed * dt
        if not step > self.farthest:
            return ""
        i = int(np.argmax(np.sum(self.nodes.velocity[:, : self.n_nodes] ** 2, axis=0)))
        return (
            f"node {i} of {self.name_of(i)} moves {step:.3g} mm in one step, which exceeds the limit of "
            f"{self.farthest:.3g} mm: contacts could be missed"
        )

    def _piercing_fault(self) -> str:
        contacts, count = self.tracker.contacts, self.tracker.count
        if self.soft_contact is not None:
            return self.soft_contact.piercing_fault()
        if not monitor.count_pierced(contacts.offset, contacts.reach, contacts.line, count, NEAREST):
            return ""
        share = np.linalg.norm(contacts.offset[:, :count], axis=0) / contacts.reach[:count]
        c = int(np.argmin(np.where(contacts.line[:count] != SIDE_BY_SIDE, share, np.inf)))
        names = " and ".join(self.name_of(int(i)) for i in contacts.piece[:, c])
        return f"{names} pass through each other (node {int(contacts.piece[0, c])})"

    def stable_step(self) -> tuple[float, str]:
        """Critical step [ms] of the node that its contacts load most, and its name; infinite where none touches."""
        if not self.contact:
            return super().stable_step()
        beams = self.axial_stiffness, self.shear_stiffness, self.nodes, self.node_load
        if self.soft_contact is not None:
            i, bound = monitor.stiffest_soft_node(self.soft_contact.pairs, self.soft_contact.law, *beams)
        else:
            i, bound = monitor.stiffest_node(self.tracker.contacts, self.tracker.count, self.law, *beams)
        if i < 0 or bound <= 0.0:
            return np.inf, ""
        return 2.0 / float(bound) ** 0.5, f"contacts on node {i} of {self.name_of(i)}"

    def state(self) -> State:
        """See :meth:`ExplicitModel.state`; adds living beams and contacts."""
        return super().state() | arrays_of("beams", self.beams, CHANGING) | with_prefix("tracker", self.tracker.state())

    def restore(self, state: State) -> None:
        """See :meth:`ExplicitModel.restore`."""
        super().restore(state)
        put_back(state, "beams", self.beams, CHANGING)
        self.tracker.restore(without_prefix(state, "tracker"))

    def name_of(self, node: int) -> str:
        """System and number of the yarn that owns ``node``: ``warp yarn 3``, and ``yarn 3`` of a system ``yarn``."""
        yarn = int(self.group.chain[node])
        part = int(self.mesh.part[self.mesh.yarn == yarn][0])
        first = int(self.mesh.yarn[self.mesh.part == part].min())
        return f"{self.mesh.part_names[part].removesuffix('yarn')} yarn {yarn - first + 1}".strip()
