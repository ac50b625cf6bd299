"""Rigs that imported tests were done with, and what they found, as fields of the rigs of runs."""

from collections.abc import Mapping
from typing import Any

from knittest.experiment.lab_kind import LAB_TESTS, Rigs


def rigs_of(tests: Mapping[str, dict[str, Any]]) -> Rigs:
    """Fields by test, by direction where both were tested; ``tests`` are the statistics of an experiment."""
    return {name: fields for lab in LAB_TESTS.values() for name, fields in lab.rigs(tests).items()}
