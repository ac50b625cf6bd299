"""The quality gates that all tests share: what is measured, its limit, and when a comparison is refused."""

from dataclasses import dataclass
from typing import Literal

from knittest.base.history import Quality
from knittest.base.kinds import kinds
from knittest.config.looser import loosened
from knittest.config.run import Run

#: rows of the energies that a judgement needs
LEAST_ROWS = 10
#: share of a limit from which on a value is worth a warning
NEAR = 0.5


@dataclass(frozen=True)
class SolverGate:
    """Gate on a number of :class:`Quality`, and of summary.json, by ``key``, times ``scale`` [%].

    ``limit`` is the solver's field that bounds it; ``only``, where it is not for all, a scale, or ``own`` for tests
    whose record names it.
    """

    label: str
    key: str
    limit: str
    scale: float = 100.0
    only: Literal["", "macro", "meso", "own"] = ""

    def value(self, quality: Quality) -> float:
        """Value in a run [%]."""
        return self.scale * float(getattr(quality, self.key))

    def applies(self, run: Run) -> bool:
        """Tell whether it means something in ``run``."""
        if self.only == "own":
            return self.key in kinds()[run.rig.kind].gates
        return self.only in ("", run.model.scale)


#: judged of shells at rest too
HOURGLASS = SolverGate("hourglass over internal energy", "hourglass_over_internal_max", "max_hourglass", only="macro")
GATES = (
    SolverGate("kinetic energy over work", "ke_over_ie_max", "max_kinetic_ratio"),
    SolverGate("energy error", "energy_error_max", "max_energy_error"),
    SolverGate("damping over work", "damping_over_work_max", "max_damping"),
    SolverGate("damping of contacts over work", "contact_damping_over_work_max", "max_contact_damping"),
    HOURGLASS,
    SolverGate("penetration over radius", "penetration_over_radius_max", "max_penetration"),
    SolverGate("overlap of yarns at the start", "overlap_at_start", "max_overlap"),
    SolverGate("overlap of yarns that carries no force", "force_free_overlap_max", "max_force_free", only="meso"),
    SolverGate("added mass", "added_mass_pct", "max_added_mass", scale=1.0),
    SolverGate("sheared beyond the end of the law", "beyond_law", "max_beyond_law", only="macro"),
    SolverGate("drag of damping over weight and holder's force", "drag_over_weight", "max_drag", only="own"),
)


def gates_of(run: Run) -> list[SolverGate]:
    """The gates of a test that is integrated in time."""
    return [gate for gate in GATES if gate.applies(run)]


def limits_judged(run: Run, quality: Quality) -> Quality:
    """``quality``, refused where a limit is looser than the preset's and nobody accepted that; else with a warning."""
    found = [one.stated for one in loosened(run)]
    if run.accept_limits:
        return quality.warning(*(f"{text}: accepted by --accept-limits" for text in found))
    for text in found:
        quality = quality.refusing(f"{text}: leave it, or accept it with --accept-limits")
    return quality
