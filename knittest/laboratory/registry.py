"""Tests and their reports by the name of the rig, of all installed packages."""

from collections.abc import Mapping
from typing import Any

from knittest.base.kinds import Parts
from knittest.laboratory.base import Test
from knittest.laboratory.report_base import Report

# each takes runs of its own kind, which only their name tells
TESTS: Mapping[str, Test[Any]] = Parts(lambda kind: kind.load("test")())
REPORTS: Mapping[str, Report[Any]] = Parts(lambda kind: kind.load("report")())
