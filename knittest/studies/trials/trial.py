"""A trial: one run, known by a key of all that its result depends on."""

import hashlib
import json
from dataclasses import dataclass
from functools import cache

import knittest
from knittest.base.errors import InputError
from knittest.base.kinds import kinds, package_digest
from knittest.base.resources import PACKAGE
from knittest.config.run import Run
from knittest.export.identity import FREE, data_files
from knittest.export.provenance import sha256_files
from knittest.runs.opening import Place

#: sources that show, schedule or judge runs; a change of any other one makes all trials new
AROUND = (
    "cli", "studies", "report_page", "base/progress.py", "runs/show.py", "laboratory/error_notes.py",
    "laboratory/numerical_error.py", "laboratory/remeshing.py",
)  # fmt: skip
KEY_DIGITS = 16


@dataclass(frozen=True)
class Trial:
    """A run to do; ``label`` names it to a user, ``key`` to the folder it is kept in, which is opened as ``place`` says
    if it says anything. Of an ensemble it may be one ``specimen`` only, in the folder that the process which started it
    has opened.
    """

    run: Run
    key: str
    label: str = ""
    specimen: int | None = None
    place: Place | None = None


def trial_of(run: Run, label: str = "") -> Trial:
    """The trial of ``run`` with the code and data that are here now.

    Raises :class:`InputError` for unreadable data, and for a run to be verified: a trial is one run.
    """
    if run.output.verify:
        raise InputError(
            "output.verify: the runs of a sweep, calibration or regression are not repeated for their numerical error; "
            "leave it out, and verify single runs of the test's own command with --verify"
        )
    config = run.model_dump(mode="json")
    for path in FREE:
        *holders, name = path.split(".")
        holder = config
        for part in holders:
            holder = holder[part]
        del holder[name]
    content = {
        "config": config,
        "version": knittest.__version__,
        "code": code_digest(),
        **package_digest(kinds()[run.rig.kind]),
        "data": sha256_files(data_files(run)),
    }
    text = json.dumps(content, sort_keys=True)
    return Trial(run, hashlib.sha256(text.encode()).hexdigest()[:KEY_DIGITS], label)


@cache
def code_digest() -> str:
    """Digest of the sources that a result depends on, as they were when this process first asked."""
    digest = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE)
        if not any(name.is_relative_to(one) for one in AROUND):
            digest.update(name.as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:KEY_DIGITS]
