"""Contact between all chains of a model: its law, stiffness and resistance to spin."""

from dataclasses import dataclass

from knittest.kernels.contact import penalty
from knittest.kernels.state import ContactLaw
from knittest.materials.soft_shell import SoftShell
from knittest.materials.yarn_section import EVEN, Patch

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
    side leaves them no room. ``compliant`` yarns store little energy: contacts found late get their force in small
    portions, and the yarns take long to come to rest. Yarns with a ``shell`` touch by its law instead of the penalty,
    with the coefficient ``friction`` and the ratio of ``tangential`` to ``normal``.
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
    compliant: bool = False
    shell: SoftShell | None = None

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

    def stiffest(self, radius: float, length: float = 0.0) -> float:
        """Largest stiffness [N/mm] between yarns of ``radius`` [mm], of soft ones with beams of ``length`` [mm]."""
        if self.shell is not None:
            return self.shell.stiffest(length)
        law = self.law(radius, 0.0)
        return float(penalty.py_func(law.cap, law.normal, law.linear, law.square, law.cubic, law.cap)[1])

    def torsional(self, bearable: float) -> float:
        """Stiffness against spin [N mm/rad], at most ``bearable``: that of a disc of sticking springs as wide as the
        smallest patch; 0 where nothing resists.
        """
        if self.patch is None:
            return 0.0
        return min(0.5 * self.tangential * (self.patch.least / EVEN) ** 2, bearable)
