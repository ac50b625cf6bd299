"""Origin of the rows of a friction test."""

from pathlib import Path

from knittest.base.resources import data_dir
from knittest.config.own_rig import own_fields
from knittest.experiment.friction_origin import assumed_friction
from knittest.experiment.origin import Origin
from knittest.laboratory.friction.config import FrictionRun


class FrictionOrigin(Origin[FrictionRun]):
    """See :class:`knittest.experiment.origin.Origin`."""

    def assumed(self, run: FrictionRun) -> tuple[str, ...]:
        """Coefficients of the other direction, or of the paper's fabrics."""
        return assumed_friction(run)

    def gave(self, run: FrictionRun, path: Path) -> str:
        """The coefficients, of the fabric's own friction tests, which its file gives to the rig."""
        own = run.fabric.experiment
        if own is None or not _is_own(run):
            return ""
        of_its_own = path.resolve().is_relative_to((data_dir() / own).resolve())
        return "its coefficients were given to the run" if of_its_own else ""


def _is_own(run: FrictionRun) -> bool:
    """Tell whether the fabric gives the rig of ``run``, in its direction, a coefficient."""
    kind = run.rig.kind
    return "kinetic_coefficient" in own_fields(run.fabric.rigs.get(kind, {}), kind, run.rig.direction)
