"""The reports by the name of the rig."""

from typing import Any

from knittest.reports.tensile import TensileReport

REPORTS: dict[str, Any] = {"tensile": TensileReport()}
