"""Origin of the rows of a cantilever."""

from knittest.experiment.origin import Origin, RowKind
from knittest.laboratory.cantilever.config import CantileverRun


class CantileverOrigin(Origin[CantileverRun]):
    """See :class:`knittest.experiment.origin.Origin`."""

    def given(self, run: CantileverRun) -> tuple[str, ...]:
        """The overhang, where the chord angle is looked for."""
        return ("overhang_mm",) if run.rig.mode == "angle" else ()

    def fed(self, run: CantileverRun) -> RowKind:
        """An overhang that is found again is tuned: bending follows from it by Eq. 2."""
        return "tuned" if run.rig.mode == "overhang" else "input"
