"""Tests and their reports by the name of the rig, of all installed packages."""

from collections.abc import Mapping
from typing import Any

from knittest.base.kinds import Parts

TESTS: Mapping[str, Any] = Parts(lambda kind: kind.load("test")())
REPORTS: Mapping[str, Any] = Parts(lambda kind: kind.load("report")())
