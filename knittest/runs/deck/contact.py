"""Contact of a deck: yarns with each other, a sheet with itself, and either with tools."""

from dataclasses import dataclass

from knittest.export.keywords import KeywordFile
from knittest.models.yarn_contact import CONTACT_DAMPING
from knittest.runs.deck.tools import SEEN

#: kinds of surface in *CONTACT: a set of parts, a part
PART_SET, PART = 2, 3
#: stiffness by the masses of the nodes and the step, as the laboratory's contact with tools has it
SOFT = 1
#: overlaps at the start are free of force and tracked
IGNORE = 1
#: decay [ms/mm] by which a static coefficient above the kinetic one is gone at 0.01 mm/ms
DECAY = 500.0


@dataclass(frozen=True)
class Rubbing:
    """Coulomb coefficients before and while it slips, and viscous damping over critical [-]."""

    static: float
    kinetic: float
    damping: float = CONTACT_DAMPING


def add_part_set(deck: KeywordFile, title: str, parts: list[int]) -> int:
    """Add a set of ``parts``; returns its number."""
    number = deck.number_for("part set")
    deck.keyword("SET_PART_LIST_TITLE", title)
    deck.card("sid da1 da2 da3 da4 solver", number, 0.0, 0.0, 0.0, 0.0, "MECH")
    deck.numbers(parts)
    return number


def add_within(deck: KeywordFile, kind: str, title: str, parts: int, law: Rubbing, pressed: bool = False) -> None:
    """Add contact of ``kind`` of a set of ``parts`` with itself; what is ``pressed`` at the start pushes apart."""
    _add(deck, kind, title, (parts, 0, PART_SET, 0), law, (None, None), 0 if pressed else IGNORE)


def add_with_tool(
    deck: KeywordFile, kind: str, title: str, part: int, tool: int, law: Rubbing, thickness: float
) -> None:
    """Add contact of ``kind`` of a ``part`` of ``thickness`` [mm] with the part of a ``tool``."""
    _add(deck, kind, title, (part, tool, PART, PART), law, (thickness, SEEN), IGNORE)


def _add(
    deck: KeywordFile,
    kind: str,
    title: str,
    surfaces: tuple[int, int, int, int],
    law: Rubbing,
    thickness: tuple[float | None, float | None],
    ignore: int,
) -> None:
    deck.keyword(f"CONTACT_{kind}_ID")
    deck.card("cid heading:70", deck.number_for("contact"), title.replace(",", ";")[:70])
    deck.card("surfa surfb surfatyp surfbtyp saboxid sbboxid sapr sbpr", *surfaces, 0, 0, 1, 1)
    decay = DECAY if law.static > law.kinetic else 0.0
    deck.card("fs fd dc vc vdc penchk bt dt", law.static, law.kinetic, decay, 0.0, 100.0 * law.damping, 0, 0.0, 1e20)
    deck.card("sfsa sfsb sast sbst sfsat sfsbt fsf vsf", 1.0, 1.0, *thickness, 1.0, 1.0, 1.0, 1.0)
    deck.card("soft sofscl lcidab maxpar sbopt depth bsort frcfrq", SOFT, 0.1, 0, 1.025, 2, 2, 0, 1)
    deck.card("penmax thkopt shlthk snlog isym i2d3d sldthk sldstf", 0.0, 0, 0, 0, 0, 0, 0.0, 0.0)
    deck.card("igap ignore dprfac dtstif edgek unused flangl cid_rcf", 1, ignore, 0.0, 0.0, 0.0, None, 0.0, 0)
