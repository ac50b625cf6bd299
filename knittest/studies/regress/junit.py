"""JUnit XML, as CI servers read it: a test case a row of Table 3 and a case of drift."""

import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

from knittest.base.atomic import write_atomic
from knittest.studies.regress.drift import Drift
from knittest.studies.regress.judge import Row
from knittest.studies.regress.outcome import LOST, Outcome

#: what XML 1.0 cannot hold
FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def write_junit(path: Path, outcome: Outcome) -> None:
    """Write ``outcome`` to ``path``; raises :class:`ResourceError`."""
    root = ET.Element("testsuites", name="knittest regress")
    _suite(root, "table 3", [_table3(row) for row in outcome.rows])
    _suite(root, "drift", [*(_drift(drift, outcome) for drift in outcome.drifts), *map(_lost, outcome.lost)])
    ET.indent(root)
    write_atomic(path, ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")


def _suite(root: ET.Element, name: str, cases: Sequence[ET.Element]) -> None:
    failed, errors = (sum(case.find(what) is not None for case in cases) for what in ("failure", "error"))
    time = sum(float(case.get("time", "0")) for case in cases)
    suite = ET.SubElement(
        root, "testsuite", name=name, tests=str(len(cases)), failures=str(failed), errors=str(errors),
        skipped="0", time=f"{time:.3f}",
    )  # fmt: skip
    suite.extend(cases)


def _table3(row: Row) -> ET.Element:
    name = f"{row.case.specimen} {row.quantity} ({row.kind})"
    case = ET.Element("testcase", classname=f"table3.{row.case.test}.{row.case.scale}", name=name, time="0")
    if not row.passed:
        _failure(case, row.reason, f"{row.simulated:.6g} simulated, {row.mean:g} ± {row.sd:g} measured; {row.rule}")
    return case


def _drift(drift: Drift, outcome: Outcome) -> ET.Element:
    seconds = outcome.records[drift.case].seconds
    case = ET.Element(
        "testcase", classname=f"drift.{drift.case.test}.{drift.case.scale}", name=drift.case.name, time=f"{seconds:.3f}"
    )
    if not drift.passed:
        _failure(case, drift.reasons[0], "\n".join(drift.reasons), drift.no_room)
    return case


def _lost(name: str) -> ET.Element:
    case = ET.Element("testcase", classname="drift.lost", name=name, time="0")
    _failure(case, LOST, LOST)
    return case


def _failure(case: ET.Element, message: str, text: str, no_room: bool = False) -> None:
    tag, kind = ("error", "ResourceError") if no_room else ("failure", "OutOfTolerance")
    failure = ET.SubElement(case, tag, message=FORBIDDEN.sub("?", message), type=kind)
    failure.text = FORBIDDEN.sub("?", text)
