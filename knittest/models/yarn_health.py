"""Contact between the chains of a model, and faults that make it unusable: a collapsed beam, one whose sections turn
against its axis, a yarn that passes another.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from knittest.base.arrays import Array
from knittest.kernels import monitor
from knittest.kernels.contact import BESIDE, penalty
from knittest.kernels.state import Beams, ContactLaw, Partitions
from knittest.materials.yarn_section import EVEN, Patch
from knittest.models.contact_tracker import LEAST_STEPS
from knittest.models.natural_state import refuse_conforming

if TYPE_CHECKING:
    from knittest.models.yarn_model import YarnModel

#: length over rest length below which a beam has collapsed
SHORTEST = 0.1
#: distance of the centre-lines of a crossing over its reach below which one yarn is about to pass the other
NEAREST = 0.1


class YarnHealth:
    """Checks of one model, whose arrays the kernels may replace between two checks."""

    def __init__(self, model: "YarnModel") -> None:
        self.model = model
        self.axial, self.shear = _stiffness(model.parts, model.beams)
        self.load = np.zeros((model.n_nodes, 6))
        # both yarns of a crossing may move, and contacts are looked at every LEAST_STEPS steps at the latest
        self.farthest = float(model.group.radius.min()) / LEAST_STEPS

    def diagnose(self, dt: float) -> str:
        """Diagnose the present state at time step ``dt`` [ms]; empty if nothing is wrong.

        Raises :class:`InputError` for sections that lie along the loops, see :func:`refuse_conforming`.
        """
        model = self.model
        fault = self.invalid_state(dt)
        if fault or not model.contact:
            return fault
        refuse_conforming(model.tracker, model.nodes.position)
        return ""

    def invalid_state(self, dt: float) -> str:
        """Describe a collapsed beam, one whose sections turn, yarns that pass each other, or a node too fast for the
        search of contacts at time step ``dt`` [ms]; empty if there is none.
        """
        model = self.model
        if monitor.count_short_beams(model.nodes.position, model.beams.alive, model.beams.inv_length, SHORTEST):
            return self._collapsed()
        return self._turning() or ((self._pierced() or self._too_fast(dt)) if model.contact else "")

    def _turning(self) -> str:
        model = self.model
        i, ratio = monitor.least_stable_beam(model.nodes, model.parts, model.beams)
        if ratio <= 1.0:
            return ""
        chord = model.nodes.position[:, i + 1] - model.nodes.position[:, i]
        stretch = float(np.linalg.norm(chord)) * float(model.beams.inv_length[i])
        shear = float(self.shear[i] / model.beams.inv_length[i])
        tension, limit = ratio * shear * stretch, shear * stretch
        return (
            f"the tension of {model.name_of(i)} (node {i}), {tension:.4g} N at {100 * (stretch - 1):.3g} % strain, "
            f"exceeds GA (1 + e) = {limit:.4g} N: its sections are unstable in shear; use a shear stiffness GA of "
            f"at least {ratio * shear:.4g} N, or in a test a larger rig.membrane_share"
        )

    def _collapsed(self) -> str:
        model = self.model
        length = np.linalg.norm(np.diff(model.position(), axis=0, append=np.nan), axis=1)
        ratio = np.where(model.beams.alive > 0.0, length * model.beams.inv_length, np.inf)
        i = int(np.nanargmin(ratio))
        return f"a beam of {model.name_of(i)} (node {i}) has collapsed to {100 * ratio[i]:.1f} % of its length"

    def _too_fast(self, dt: float) -> str:
        step = self.model.tracker.speed * dt
        if not step > self.farthest:
            return ""
        i = int(np.argmax(np.sum(self.model.nodes.velocity[:, : self.model.n_nodes] ** 2, axis=0)))
        return (
            f"node {i} of {self.model.name_of(i)} moves {step:.3g} mm in one step, which exceeds the limit of "
            f"{self.farthest:.3g} mm: contacts could be missed"
        )

    def _pierced(self) -> str:
        contacts, count = self.model.tracker.contacts, self.model.tracker.count
        if not monitor.count_pierced(contacts.offset, contacts.reach, contacts.line, count, NEAREST):
            return ""
        share = np.linalg.norm(contacts.offset[:, :count], axis=0) / contacts.reach[:count]
        c = int(np.argmin(np.where(contacts.line[:count] != BESIDE, share, np.inf)))
        names = " and ".join(self.model.name_of(int(i)) for i in contacts.piece[:, c])
        return f"{names} pass through each other (node {int(contacts.piece[0, c])})"

    def stable_step(self) -> tuple[float, str]:
        """Critical step [ms] of the node that its contacts load most, and its name; infinite where none touches."""
        model = self.model
        i, bound = monitor.stiffest_node(
            model.tracker.contacts, model.tracker.count, model.law, self.axial, self.shear, model.nodes, self.load,
        )  # fmt: skip
        if i < 0 or bound <= 0.0:
            return np.inf, ""
        return 2.0 / float(bound) ** 0.5, f"contacts on node {i} of {model.name_of(i)}"


def _stiffness(parts: Partitions, beams: Beams) -> tuple[Array, Array]:
    """Largest axial and the shear stiffness of every living beam [N/mm], (n_nodes,) each, 0 where there is none."""
    tangent = np.maximum(beams.stiffness[:, 0], np.cumsum(beams.hinge_slope, axis=1).max(axis=1))
    axial, shear = np.zeros(beams.alive.size), np.zeros(beams.alive.size)
    for start, stop, section in parts.span:
        if section >= 0:
            living = np.where(beams.alive[start:stop] > 0.0, beams.inv_length[start:stop], 0.0)
            axial[start:stop], shear[start:stop] = tangent[section] * living, beams.stiffness[section, 1] * living
    return axial, shear


#: share of critical damping of a touching pair of nodes
CONTACT_DAMPING = 0.1
#: penetration over the smallest radius beyond which compaction stiffens no more; such runs fail their checks
COMPACTION_ENDS = 0.5


@dataclass(frozen=True)
class YarnContact:
    """Contact between all chains: penalty and sticking stiffness [N/mm], Coulomb coefficient while slipping, share of
    critical damping of a touching pair of nodes, Coulomb coefficient before it slips (none: the same).

    ``compaction`` (exponent 1, 2 or 3, depth [mm]) makes the force normal d (1 + (d / depth)^exponent). ``patch`` makes
    crossings resist spin, ``Patch.disc(R)`` up to 2/3 friction N R; slip and spin share one limit. None: free spin.
    Yarns that overlap at the start are free of force there, or ``pressed``: they press each other by all of it, and
    relax. The ``cut`` first and last pieces of yarns do not press those of others: what holds cut ends side by
    side leaves them no room.
    """

    normal: float
    tangential: float
    friction: float
    damping: float = CONTACT_DAMPING
    static: float | None = None
    compaction: tuple[int, float] | None = None
    patch: Patch | None = None
    pressed: bool = False
    cut: int = 0

    def law(self, radius: float, viscous: float, torsional: float = 0.0) -> ContactLaw:
        """Contact law of yarns whose smallest radius is ``radius`` [mm], with ``viscous`` [N ms/mm] and ``torsional``
        stiffness [N mm/rad].
        """
        stiffening = [0.0, 0.0, 0.0]
        if self.compaction is not None:
            exponent, depth = self.compaction
            stiffening[exponent - 1] = depth**-exponent
        static = self.friction if self.static is None else self.static
        softening = 0.0 if self.patch is None else float(self.patch.exponent)
        return ContactLaw(
            self.normal, self.tangential, static, self.friction, viscous, stiffening[0], stiffening[1], stiffening[2],
            COMPACTION_ENDS * radius, torsional, softening,
        )  # fmt: skip

    def stiffest(self, radius: float) -> float:
        """Largest stiffness [N/mm] between yarns of ``radius`` [mm]."""
        law = self.law(radius, 0.0)
        return float(penalty.py_func(law.cap, law.normal, law.linear, law.square, law.cubic, law.cap)[1])

    def torsional(self, bearable: float) -> float:
        """Stiffness against spin [N mm/rad], at most ``bearable``: that of a disc of sticking springs as wide as the
        smallest patch; 0 where nothing resists.
        """
        if self.patch is None:
            return 0.0
        return min(0.5 * self.tangential * (self.patch.least / EVEN) ** 2, bearable)
