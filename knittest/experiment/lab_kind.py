"""Files of a testing machine in the record of a test: how they are read, shown, written and told apart."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from knittest.base.kinds import Parts, kinds
from knittest.experiment.lab_conditions import Condition
from knittest.experiment.lab_given import Given

#: fields of the rig, by test, from the statistics of an experiment by folder
Rigs = dict[str, dict[str, Any]]


def nobody(cells: Sequence[str]) -> bool:
    """Cells that tell nothing."""
    return False


def no_rigs(tests: Mapping[str, dict[str, Any]]) -> Rigs:
    """Return no fields, of a test that says nothing of rigs."""
    return {}


def no_fabric(tests: Mapping[str, dict[str, Any]], place: Path) -> dict[str, Any]:
    """Return no fields, of a test that says nothing of the fabric."""
    return {}


SpecimenT = TypeVar("SpecimenT")


@dataclass(frozen=True)
class LabTest(Generic[SpecimenT]):
    """``read`` a file into specimens, show them as ``lines``, ``write`` them with direction and whether it is trusted.

    ``conditions`` and ``options`` are those that a user may give. ``looks`` tells by the cells at the head of a file
    whether it is one of this test, ``named`` by its name; ``rigs`` is what an experiment says of rigs,
    ``fabric`` what it says of the fabric, with the folder that files are named from.
    """

    read: Callable[[Path, Given], list[SpecimenT]]
    lines: Callable[[Sequence[SpecimenT]], list[str]]
    write: Callable[[Sequence[SpecimenT], Path, str, Sequence[str], bool], str]
    conditions: tuple[Condition, ...]
    options: tuple[str, ...] = ()
    looks: Callable[[Sequence[str]], bool] = nobody
    named: re.Pattern[str] | None = None
    rigs: Callable[[Mapping[str, dict[str, Any]]], Rigs] = no_rigs
    fabric: Callable[[Mapping[str, dict[str, Any]], Path], dict[str, Any]] = no_fabric


LAB_TESTS: Mapping[str, LabTest[Any]] = Parts(lambda kind: kind.load("laboratory"), "laboratory")


def directed(test: str) -> bool:
    """Tell whether specimens of ``test`` lie along warp or weft."""
    return kinds()[test].directional
