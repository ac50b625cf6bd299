"""Origin of the results of forming."""

from knittest.experiment.friction_origin import assumed_friction
from knittest.experiment.origin import Origin
from knittest.laboratory.forming.config import FormingRun


class FormingOrigin(Origin[FormingRun]):
    """See :class:`knittest.experiment.origin.Origin`."""

    def assumed(self, run: FormingRun) -> tuple[str, ...]:
        """Assumed numbers of the fabric, and the friction of the tools where it was not measured for it."""
        return (*super().assumed(run), *assumed_friction(run))
