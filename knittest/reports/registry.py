"""The reports by the name of the rig."""

from typing import Any

from knittest.reports.cantilever import CantileverReport
from knittest.reports.forming import FormingReport
from knittest.reports.friction import FrictionReport
from knittest.reports.picture_frame import PictureFrameReport
from knittest.reports.tensile import TensileReport

REPORTS: dict[str, Any] = {
    "tensile": TensileReport(),
    "picture-frame": PictureFrameReport(),
    "cantilever": CantileverReport(),
    "friction": FrictionReport(),
    "forming": FormingReport(),
}
