"""Search by Optuna's tree-structured Parzen estimator (Bergstra et al., 2011), and the database of its trials: SQLite
in the folder of the calibration, or any with a URL.
"""

import hashlib
import json
import math
import socket
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from knittest.base.errors import InputError, ResourceError
from knittest.base.files import excerpt
from knittest.base.machine import hide_passwords
from knittest.export.files import json_ready
from knittest.studies.calibrate.fit import GLOBAL_SHARE, cost, fit_best
from knittest.studies.calibrate.problem import Evaluation, Evaluator, Point, Problem, RunLimitReached
from knittest.studies.trials.trial import code_digest

if TYPE_CHECKING:
    from optuna import Study
    from optuna.storages import RDBStorage
    from optuna.trial import FrozenTrial, Trial
    from sqlalchemy import URL


#: file of the database without a URL
DATABASE = "optuna.db"
#: seconds for a server to answer, and its port if the URL names none
REACH_LIMIT = 10.0
PORTS = {"postgresql": 5432, "mysql": 3306, "mariadb": 3306, "mssql": 1433, "oracle": 1521}
DIGITS = 12
#: fields that may change when a study is resumed
CHANGEABLE_FIELDS = {"max_runs", "time_limit", "tolerance", "noise", "step", "storage"}


def open_storage(url: str, where: str) -> "RDBStorage":
    """Open the database at ``url`` and make its tables if they are missing; ``where`` says who named it.

    Raises :class:`InputError` for an invalid URL, an unknown kind of database and a missing driver;
    :class:`ResourceError` if the database cannot be reached or read.
    """
    import optuna
    from sqlalchemy import make_url
    from sqlalchemy.exc import ArgumentError, NoSuchModuleError

    optuna.logging.set_verbosity(optuna.logging.CRITICAL)  # the exceptions have the same messages
    try:
        parts = make_url(url)
        shown = f"{where}: {_url_text(parts)}"
        parts.get_dialect().import_dbapi()
        _check_connection(parts, shown)
        with convert_database_errors(shown):
            return optuna.storages.RDBStorage(url)
    except ImportError as error:
        why = hide_passwords(str(error))
        raise InputError(f"{shown}: the driver of this database is not installed: {why}") from None
    except (ArgumentError, NoSuchModuleError, ValueError) as error:
        why = hide_passwords(excerpt(str(error)))
        example = "sqlite:///study.db or postgresql://user@host/name"
        raise InputError(f"{where}: not the URL of a known database: {why}; expected for example {example}") from None


@contextmanager
def convert_database_errors(shown: str) -> Iterator[None]:
    """Turn errors of the database ``shown`` into a :class:`ResourceError`."""
    from optuna.exceptions import StorageInternalError
    from sqlalchemy.exc import SQLAlchemyError

    try:
        yield
    except (SQLAlchemyError, StorageInternalError) as error:
        cause = error.__cause__ if isinstance(error, StorageInternalError) and error.__cause__ else error
        why = hide_passwords(excerpt(str(getattr(cause, "orig", None) or cause)))
        raise ResourceError(f"{shown}: the database does not answer: {why}; finished runs are kept") from None
    except RuntimeError as error:  # tables of another version of Optuna
        raise ResourceError(f"{shown}: {hide_passwords(excerpt(str(error)))}") from None


def open_study(problem: Problem, storage: "RDBStorage", folder: Path) -> "Study":
    """Open the study of ``problem`` in ``folder``, a new one for other code; raises :class:`ResourceError`."""
    import optuna

    calibration = problem.calibration.model_dump(mode="json", exclude=CHANGEABLE_FIELDS)
    runs = [case.run().model_dump(mode="json") for case in problem.cases]
    content = [calibration, runs, code_digest(), socket.gethostname(), str(folder.resolve())]
    text = json.dumps(json_ready(content), sort_keys=True)
    with convert_database_errors(url_without_password(storage)):
        name = f"{problem.name}-{hashlib.sha256(text.encode()).hexdigest()[:DIGITS]}"
        return optuna.create_study(storage=storage, study_name=name, direction="minimize", load_if_exists=True)


def url_without_password(storage: "RDBStorage") -> str:
    """URL of ``storage`` without a password."""
    return _url_text(storage.engine.url)


def _url_text(url: "URL") -> str:
    return hide_passwords(url.render_as_string(hide_password=True))


def hide_storage_password(text: str, storage: str | None) -> str:
    """Remove passwords from the calibration file ``text``, also from its database ``storage`` in any notation."""
    import yaml

    if storage is not None and hide_passwords(storage) != storage:
        root = yaml.compose(text, yaml.SafeLoader)
        assert isinstance(root, yaml.MappingNode)  # the file was read before
        (value,) = (node for key, node in root.value if key.value == "storage")
        begin, end = value.start_mark.index, value.end_mark.index
        lines = "\n" * text.count("\n", begin, end)  # the rest keeps its lines
        text = f"{text[:begin]}{json.dumps(hide_passwords(storage))}{lines}{text[end:]}"
    return hide_passwords(text)


def _check_connection(url: "URL", shown: str) -> None:
    """Connect to the server once: some drivers wait for minutes for a missing one."""
    port = url.port or PORTS.get(url.get_backend_name())
    if not url.host or port is None:
        return
    try:
        socket.create_connection((url.host, port), REACH_LIMIT).close()
    except OSError as error:
        raise ResourceError(f"{shown}: no answer from {url.host}:{port}: {error}") from None


#: points evaluated in parallel, and random points for each parameter at the start
BATCH, AT_RANDOM = 4, 4
#: characters of a reason in the database
LONGEST_REASON = 2000


def search_with_optuna(evaluator: Evaluator, study: "Study", database: str) -> None:
    """Search ``study`` with a part of the runs, or until all targets are met; then least squares from the best.

    Trials of an earlier call are evaluated first, from the ledger: no run is repeated. ``database`` is its name for the
    user. Raises :class:`RunLimitReached` for too few allowed runs, :class:`NumericalError` without any result,
    :class:`ResourceError` if the database is lost.
    """
    problem = evaluator.problem
    points = int(GLOBAL_SHARE * problem.calibration.max_runs / len(problem.cases))
    least = AT_RANDOM * len(problem.parameters) + BATCH
    if points < least:
        needed = math.ceil(least * len(problem.cases) / GLOBAL_SHARE)
        raise RunLimitReached(f"max_runs = {problem.calibration.max_runs}: optuna needs at least {needed} runs here")
    with convert_database_errors(database):
        _search(evaluator, study, points)
    fit_best(evaluator)


def _search(evaluator: Evaluator, study: "Study", points: int) -> None:
    """Evaluate the trials of the study, then ask it for more, up to ``points`` in all."""
    from optuna.trial import TrialState

    known = [trial for trial in study.get_trials(deepcopy=False) if trial.state != TrialState.WAITING]
    _replay(evaluator, study, known)
    if not study.get_trials(deepcopy=False):
        study.enqueue_trial({p.name: p.start for p in evaluator.problem.parameters})
    asked = len(known)
    while asked < points and not _meets_targets(evaluator):
        trials = [_ask_trial(evaluator, study, asked + k) for k in range(min(BATCH, points - asked))]
        asked += len(trials)
        evaluations = evaluator.evaluate_points([_point_of_trial(evaluator, trial.params) for trial in trials])
        for trial, evaluation in zip(trials, evaluations, strict=True):
            _tell(evaluator, study, trial, evaluation)


def _replay(evaluator: Evaluator, study: "Study", known: Sequence["FrozenTrial"]) -> None:
    """Evaluate the trials of earlier calls from their finished runs, and complete those that were running."""
    from optuna.trial import Trial, TrialState

    drawn = [trial for trial in known if len(trial.params) == len(evaluator.problem.parameters)]
    evaluations = evaluator.evaluate_points([_point_of_trial(evaluator, trial.params) for trial in drawn])
    for trial, evaluation in zip(drawn, evaluations, strict=True):
        if trial.state == TrialState.RUNNING:
            _tell(evaluator, study, Trial(study, trial._trial_id), evaluation)
    for trial in known:
        if trial.state == TrialState.RUNNING and trial not in drawn:  # stopped before all values were drawn
            study.tell(trial.number, state=TrialState.FAIL)


def _ask_trial(evaluator: Evaluator, study: "Study", number: int) -> "Trial":
    """Ask for a new trial; its random values depend on its ``number`` and the seed alone."""
    from optuna.exceptions import ExperimentalWarning
    from optuna.samplers import TPESampler

    calibration, parameters = evaluator.problem.calibration, evaluator.problem.parameters
    seed = int(np.random.SeedSequence([calibration.seed, number]).generate_state(1)[0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExperimentalWarning)
        # running points count as bad ones (constant liar), so that parallel points spread
        study.sampler = TPESampler(n_startup_trials=AT_RANDOM * len(parameters), constant_liar=True, seed=seed)
    trial = study.ask()
    for p in parameters:
        trial.suggest_float(p.name, p.low, p.high, log=p.log)
    return trial


def _point_of_trial(evaluator: Evaluator, values: Mapping[str, float]) -> Point:
    """Round the study's values to the digits of a calibration."""
    return tuple(p.value(p.position(values[p.name])) for p in evaluator.problem.parameters)


def _tell(evaluator: Evaluator, study: "Study", trial: "Trial", evaluation: Evaluation) -> None:
    """Write the outcome of a trial to the database.

    A trial without a result is pruned, so that the sampler avoids it, or failed if the machine may be the reason.
    """
    from optuna.trial import TrialState

    if evaluation.good:
        study.tell(trial, cost(evaluator.problem.parameters, evaluation))
        return
    trial.set_user_attr("reason", evaluation.reason[:LONGEST_REASON])
    machine = any(not r.settled and r.status != "timeout" for r in evaluation.records.values())
    study.tell(trial, state=TrialState.FAIL if machine else TrialState.PRUNED)


def _meets_targets(evaluator: Evaluator) -> bool:
    """Tell whether a point meets all targets, and no parameter has a prior."""
    tolerance = evaluator.problem.calibration.tolerance
    if any(p.prior for p in evaluator.problem.parameters):
        return False
    found = (one.deviations for one in evaluator.history)
    return any(d is not None and np.abs(d).max() <= tolerance for d in found)
