"""The reports by the name of the rig."""

from typing import Any

from knittest.laboratory.cantilever.report import CantileverReport
from knittest.laboratory.forming.report import FormingReport
from knittest.laboratory.friction.report import FrictionReport
from knittest.laboratory.picture_frame.report import PictureFrameReport
from knittest.laboratory.tensile.report import TensileReport

REPORTS: dict[str, Any] = {
    "tensile": TensileReport(),
    "picture-frame": PictureFrameReport(),
    "cantilever": CantileverReport(),
    "friction": FrictionReport(),
    "forming": FormingReport(),
}
