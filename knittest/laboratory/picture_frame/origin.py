"""Origin of the rows of a picture frame."""

from knittest.experiment.origin import Origin, RowKind
from knittest.laboratory.picture_frame.config import PictureFrameRun


class PictureFrameOrigin(Origin[PictureFrameRun]):
    """See :class:`knittest.experiment.origin.Origin`."""

    def fed(self, run: PictureFrameRun) -> RowKind:
        """Kind of the shear law that the shells return."""
        law = run.fabric.macro.shear
        if law.source in ("predicted", "tuned"):
            return "predicted" if law.source == "predicted" else "tuned"
        return "input"
