"""Records where numbers of hand-written pages come from, so that none goes stale unnoticed: docs/provenance.json.

A table between ``<!-- begin: NAME -->`` and ``<!-- end`` is written by a script of benchmarks. Its entry keeps the
hash of the table (nobody edits it by hand), the numbers that its commands were given (a preset or a fabric that
changes makes it stale), and what ``knittest regress`` had in store for the same tests (code that changes results makes
it stale).

python -m docs.provenance                 prints what is stale
python -m docs.provenance PAGE NAME       records a table anew, after the script has written it
"""

import hashlib
import json
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from docs.stored_runs import differences, inputs_of, lines_of, packed, unpacked
from knittest.config.loading import resolve
from knittest.export.identity import git_commit
from knittest.export.summary import timestamp
from knittest.studies.regress import baseline
from knittest.studies.regress.cases import Case, cases_of
from knittest.studies.regress.drift import change_of

HERE = Path(__file__).parent
FILE = HERE / "provenance.json"
BLOCK = re.compile(r"<!-- begin: (.*?) -->\n(.*?)<!-- end", re.S)


@dataclass(frozen=True)
class Made:
    """Recipe of a table: the script, what resolves the configs of its runs, and the cases of the regression that are
    nearest to them, by test and scale.
    """

    by: str
    runs: tuple[dict[str, Any], ...]
    cases: tuple[tuple[str, str], ...]


def _run(test: str, scale: str, preset: str = "quick", variant: str = "1", *sets: str, **more: Any) -> dict[str, Any]:
    return {"test": test, "scale": scale, "preset": preset, "variant": variant, "sets": sets, **more}


_STRIPS = [_run(t, "meso", direction=d) for t in ("tensile", "cantilever") for d in ("warp", "weft")]
_FORCE = "rig.blank_holder_force={}"
_WEAVE = ("cao2008-weave", "solver.safety=0.6")
_STIFFNESS = ("rig.max_angle=31", "solver.speed=0.4", "solver.damping=0.02")
_IN_PLANE = ("fabric.macro.in_plane_bending.warp=4.2", "fabric.macro.in_plane_bending.weft=3.47")
#: shells whose inlays do not bend in the plane, to compare with, or not measured anew since they do by default
_FREE = ("rig.in_plane_bending=false",)
#: size of the shells and speed of the yarns at ``paper``, for shells
_PAPER_SIZE = ("model.macro.element_size=3", "solver.speed=0.55", "solver.ramp=10")
_GRIPPING = {"parameters": "spin-friction"}
#: by page and name of the table
TABLES: dict[tuple[str, str], Made] = {
    ("homogenise.md", "benchmarks/homogenise.py"): Made(
        "python benchmarks/homogenise.py FOLDER 1",
        (*_STRIPS, _run("picture-frame", "meso"), _run("tensile", "macro"), _run("picture-frame", "macro")),
        (("tensile", "meso"), ("picture-frame", "meso"), ("tensile", "macro"), ("picture-frame", "macro")),
    ),
    ("picture-frame.md", "benchmarks/yarn_friction.py"): Made(
        "python benchmarks/yarn_friction.py FOLDER",
        tuple(
            _run("picture-frame", "meso", "quick", v, f"fabric.contact.friction_coefficient={mu}")
            for v in ("1", "2")
            for mu in (0.1, 0.3, 0.5)
        ),
        (("picture-frame", "meso"),),
    ),
    ("picture-frame.md", "benchmarks/picture_frame.py"): Made(
        "python benchmarks/picture_frame.py FOLDER",
        tuple(
            _run("picture-frame", "macro", "standard", *_WEAVE, f"rig.side={fabric}", f"rig.frame_side={frame}")
            for frame, fabric in ((216, 140), (250, 180))
        ),
        (("picture-frame", "macro"),),
    ),
    ("identify.md", "sensitivities"): Made(
        "python benchmarks/sensitivities.py FOLDER",
        (
            _run("pull-out", "meso", "quick", "1", "rig.travel=4.2", direction="weft", **_GRIPPING),
            _run("compaction", "meso", "quick", "1", "rig.side=10", "rig.max_pressure=100", **_GRIPPING),
            _run("picture-frame", "meso", "quick", "1", "rig.side=20", "rig.max_angle=15", "rig.cycles=1", **_GRIPPING),
        ),
        (("picture-frame", "meso"),),
    ),
    ("friction.md", "benchmarks/friction.py"): Made(
        "python benchmarks/friction.py FOLDER", (_run("friction", "meso", direction="warp"),), (("friction", "macro"),)
    ),
    ("speed-study.md", "benchmarks/speed_study.py"): Made(
        "python benchmarks/speed_study.py FOLDER",
        tuple(
            _run(t, s, **({} if t in ("picture-frame", "bias-extension") else {"direction": "warp"}))
            for t in ("tensile", "picture-frame", "bias-extension", "biaxial", "cantilever", "friction")
            for s in ("macro", "meso")
        ),
        (("tensile", "meso"), ("picture-frame", "meso"), ("friction", "macro"), ("cantilever", "macro")),
    ),
    ("bias-extension.md", "stiffness"): Made(
        "python benchmarks/strips.py FOLDER stiffness",
        (_run("bias-extension", "macro", "quick", "cao2008-weave", *_STIFFNESS),),
        (("bias-extension", "macro"),),
    ),
    ("bias-extension.md", "yarns"): Made(
        "python benchmarks/strips.py FOLDER yarns",
        (
            *(_run("bias-extension", "meso", p, "2") for p in ("quick", "standard")),
            _run("bias-extension", "macro", "quick", "2"),
        ),
        (("bias-extension", "macro"), ("picture-frame", "meso")),
    ),
    ("bias-extension.md", "verify"): Made(
        "python benchmarks/strips.py FOLDER verify-bias",
        (_run("bias-extension", "macro"), _run("bias-extension", "meso", "quick", "2")),
        (("bias-extension", "macro"), ("picture-frame", "meso")),
    ),
    ("biaxial.md", "verify"): Made(
        "python benchmarks/strips.py FOLDER verify-biaxial",
        (_run("biaxial", "macro", direction="warp"), _run("biaxial", "meso", "quick", "2", direction="warp")),
        (("biaxial", "macro"), ("tensile", "meso")),
    ),
    ("forming.md", "runs"): Made(
        "python benchmarks/forming.py runs RUN...",
        tuple(
            _run("forming", s, p, "1", _FORCE.format(f), *sets)
            for s, p, f, sets in (
                ("macro", "quick", 0, ()),
                ("macro", "quick", 100, ()),
                ("macro", "standard", 100, ()),
                ("macro", "paper", 100, _FREE),
                ("meso", "paper", 100, ()),
            )
        ),
        (("forming", "macro"),),
    ),
    ("forming.md", "bands"): Made(
        "python benchmarks/forming_bands.py bands RUN...",
        tuple(
            _run("forming", "macro", preset, "1", _FORCE.format(100), *sets)
            for preset, bent in (("quick", ()), ("standard", ()), ("paper", _IN_PLANE))
            for sets in (_FREE, bent)
        ),
        (("forming", "macro"),),
    ),
    ("forming.md", "work-paper"): Made(
        "python benchmarks/forming_energies.py work-paper YARNS SHELLS...",
        (
            _run("forming", "meso", "paper", "1", _FORCE.format(100)),
            *(
                _run("forming", "macro", "standard", "1", _FORCE.format(100), *_PAPER_SIZE, *sets)
                for sets in ((), _FREE)
            ),
        ),
        (("forming", "macro"), ("tensile", "meso")),
    ),
    ("forming.md", "window"): Made(
        "python benchmarks/forming.py window runs/batch-blank-holder",
        tuple(_run("forming", "macro", "quick", "1", _FORCE.format(f)) for f in (0, 25, 50, 100, 200, 400)),
        (("forming", "macro"),),
    ),
}


def blocks() -> Iterator[tuple[str, str, str]]:
    """Page, name and text of every marked table."""
    for page in sorted(HERE.glob("*.md")):
        for name, text in BLOCK.findall(page.read_text(encoding="utf-8")):
            yield page.name, name, text


def entry_of(made: Made, text: str, note: str = "") -> dict[str, Any]:
    """Record that is kept of a table with ``text``."""
    known = baseline.load(baseline.shipped_path()).entries
    return {
        "by": made.by, "note": note, "commit": git_commit(), "date": timestamp()[:10], "text": _hash(text),
        "inputs": [inputs_of(_config(run)) for run in made.runs],
        "regression": {case.name: known[case.name].results for case in _cases(made) if case.name in known},
    }  # fmt: skip


def stale(entry: dict[str, Any], made: Made, text: str) -> list[str]:
    """Reasons why a table is not what its script would write."""
    fresh = entry_of(made, text)
    found = ["edited by hand"] if entry["text"] != fresh["text"] else []
    for given, run in zip(entry["inputs"], made.runs, strict=True):
        found += [f"{run['test']} {run['scale']}: {what}" for what in differences(given, _config(run))]
    known = baseline.load(baseline.shipped_path()).entries
    for case in _cases(made):
        before, today = entry["regression"].get(case.name, {}), known.get(case.name)
        found += [f"{case.name}: {name} was {was:g}, is {today.results.get(name) if today else None}"
                  for name, was in before.items() if _moved(case, name, was, today)]  # fmt: skip
    return found


def _moved(case: Case, name: str, was: float, today: baseline.Entry | None) -> bool:
    """Tell whether a stored number of the regression left the limits within which it may change unseen."""
    if today is None or name not in today.results:
        return True
    return not change_of(case, today, name, was).passed


def _cases(made: Made) -> list[Case]:
    return [case for case in cases_of("quick") if (case.test, case.scale) in made.cases]


def _config(run: dict[str, Any]) -> dict[str, Any]:
    return resolve(**run).model_dump(mode="json")


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def load() -> dict[tuple[str, str], dict[str, Any]]:
    """Entries by page and name."""
    data = json.loads(FILE.read_text(encoding="utf-8"))
    for one in data["tables"]:
        one["inputs"] = [unpacked(inputs, data["fabrics"]) for inputs in one["inputs"]]
    return {(one["page"], one["name"]): one for one in data["tables"]}


def save(entries: dict[tuple[str, str], dict[str, Any]]) -> None:
    """Write all entries."""
    fabrics: dict[str, dict[str, Any]] = {}
    rows = [
        entries[key] | {"inputs": [packed(one, fabrics) for one in entries[key]["inputs"]]} for key in sorted(entries)
    ]
    FILE.write_text(lines_of(fabrics, "tables", rows), encoding="utf-8")


def main(arguments: list[str]) -> int:
    """Print what is stale, or record one table; returns the exit code."""
    texts = {(page, name): text for page, name, text in blocks()}
    entries = load() if FILE.exists() else {}
    if arguments:
        key, note = (arguments[0], arguments[1]), " ".join(arguments[2:])
        entries[key] = {"page": key[0], "name": key[1], **entry_of(TABLES[key], texts[key], note)}
        save(entries)
        return 0
    found = [f"docs/{k[0]}, {k[1]}: {why}" for k, one in entries.items() for why in stale(one, TABLES[k], texts[k])]
    print("\n".join(found) or "up to date")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
