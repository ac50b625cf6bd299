"""A search by Optuna's tree-structured Parzen estimator (Bergstra et al., 2011), and the database of its trials: SQLite
in the folder of the calibration, or any that a URL names.
"""

import hashlib
import json
import math
import socket
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from knittest.base.errors import InputError, NumericalError, ResourceError
from knittest.base.files import excerpt
from knittest.base.machine import without_passwords
from knittest.export.files import json_ready
from knittest.studies.calibrate.fit import GLOBAL_SHARE, best_of, cost, least_squares_from
from knittest.studies.calibrate.problem import Evaluation, Evaluator, Exhausted, Point, Problem
from knittest.studies.trials.trial import code_digest

if TYPE_CHECKING:
    from optuna import Study
    from optuna.samplers import TPESampler
    from optuna.storages import RDBStorage
    from optuna.trial import FrozenTrial, Trial, TrialState
    from sqlalchemy import URL


#: file of the study without a URL
DATABASE = "optuna.db"
#: seconds for a server to answer, and its port where the URL names none
REACH_LIMIT = 10.0
PORTS = {"postgresql": 5432, "mysql": 3306, "mariadb": 3306, "mssql": 1433, "oracle": 1521}
DIGITS = 12
#: what may change while a study goes on
FREE = {"max_runs", "time_limit", "tolerance", "noise", "step", "storage"}


def check_installed() -> None:
    """Raise :class:`InputError` without the package."""
    if find_spec("optuna") is None:
        raise InputError("method = optuna: Optuna is not installed here: pip install 'knittest[calibrate]'")


def open_storage(url: str, where: str) -> "RDBStorage":
    """The database at ``url``, its tables made where there are none; ``where`` says who named it.

    Raises :class:`InputError` for a text that is no URL, for an unknown kind of database, and for a missing driver;
    :class:`ResourceError` when the database cannot be reached or read.
    """
    import optuna
    from sqlalchemy import make_url
    from sqlalchemy.exc import ArgumentError, NoSuchModuleError

    optuna.logging.set_verbosity(optuna.logging.CRITICAL)  # what it has to say is in the exceptions
    try:
        parts = make_url(url)
        shown = f"{where}: {_shown(parts)}"
        parts.get_dialect().import_dbapi()
        _reach(parts, shown)
        with readable(shown):
            return optuna.storages.RDBStorage(url)
    except ImportError as error:
        raise InputError(
            f"{shown}: the driver of this database is not installed: {without_passwords(str(error))}"
        ) from None
    except (ArgumentError, NoSuchModuleError, ValueError) as error:
        why = without_passwords(excerpt(str(error)))
        raise InputError(f"{where}: no URL of a database that is known: {why}; expected for example "
                         "sqlite:///study.db or postgresql://user@host/name") from None  # fmt: skip


@contextmanager
def readable(shown: str) -> Iterator[None]:
    """Turn what goes wrong with the database ``shown`` into a :class:`ResourceError`."""
    from optuna.exceptions import StorageInternalError
    from sqlalchemy.exc import SQLAlchemyError

    try:
        yield
    except (SQLAlchemyError, StorageInternalError) as error:
        cause = error.__cause__ if isinstance(error, StorageInternalError) and error.__cause__ else error
        why = without_passwords(excerpt(str(getattr(cause, "orig", None) or cause)))
        raise ResourceError(f"{shown}: the database does not answer: {why}; what is finished is kept") from None
    except RuntimeError as error:  # tables of another version of Optuna
        raise ResourceError(f"{shown}: {without_passwords(excerpt(str(error)))}") from None


def open_study(problem: Problem, storage: "RDBStorage", folder: Path) -> "Study":
    """The study of ``problem`` in ``folder``, new or gone on with; another problem, code or folder has another one.

    Raises :class:`ResourceError`.
    """
    import optuna

    with readable(shown_url(storage)):
        return optuna.create_study(
            storage=storage, study_name=_name(problem, folder), direction="minimize", load_if_exists=True
        )


def shown_url(storage: "RDBStorage") -> str:
    """URL of ``storage`` without a password."""
    return _shown(storage.engine.url)


def _shown(url: "URL") -> str:
    return without_passwords(url.render_as_string(hide_password=True))


def without_password_of_storage(text: str, storage: str | None) -> str:
    """The calibration file ``text`` whose database is ``storage``, however it is written there, without passwords."""
    import yaml

    if storage is not None and without_passwords(storage) != storage:
        root = yaml.compose(text, yaml.SafeLoader)
        assert isinstance(root, yaml.MappingNode)  # it was read before
        (value,) = (node for key, node in root.value if key.value == "storage")
        begin, end = value.start_mark.index, value.end_mark.index
        lines = "\n" * text.count("\n", begin, end)  # so that what stands behind keeps its line
        text = f"{text[:begin]}{json.dumps(without_passwords(storage))}{lines}{text[end:]}"
    return without_passwords(text)


def _name(problem: Problem, folder: Path) -> str:
    calibration = problem.calibration.model_dump(mode="json", exclude=FREE)
    runs = [case.run().model_dump(mode="json") for case in problem.cases]
    content = [calibration, runs, code_digest(), socket.gethostname(), str(folder.resolve())]
    text = json.dumps(json_ready(content), sort_keys=True)
    return f"{problem.name}-{hashlib.sha256(text.encode()).hexdigest()[:DIGITS]}"


def _reach(url: "URL", shown: str) -> None:
    """Knock at the server: some drivers wait for minutes for one that is not there."""
    port = url.port or PORTS.get(url.get_backend_name())
    if not url.host or port is None:
        return
    try:
        socket.create_connection((url.host, port), REACH_LIMIT).close()
    except OSError as error:
        raise ResourceError(f"{shown}: no answer from {url.host}:{port}: {error}") from None


#: points that are asked for at once, so that several processes have work, and random ones for each parameter at first
BATCH, AT_RANDOM = 4, 4
#: characters of a reason in the database
LONGEST_REASON = 2000


def search_with_optuna(evaluator: Evaluator, study: "Study", database: str) -> None:
    """Search ``study`` with a part of the runs, or until all targets are met; then least squares from the best.

    Trials of an earlier call are evaluated first, which the ledger answers, so that nothing runs twice; ``database`` is
    how the user knows it. Raises :class:`Exhausted` when the runs allowed are too few, :class:`NumericalError` without
    any number, :class:`ResourceError` when the database is lost.
    """
    problem = evaluator.problem
    points = int(GLOBAL_SHARE * problem.calibration.max_runs / len(problem.cases))
    least = AT_RANDOM * len(problem.parameters) + BATCH
    if points < least:
        needed = math.ceil(least * len(problem.cases) / GLOBAL_SHARE)
        raise Exhausted(f"max_runs = {problem.calibration.max_runs}: optuna needs {needed} runs here at least")
    with readable(database):
        _search(evaluator, study, points)
    best = best_of(problem.parameters, evaluator.history)
    if best is None:
        raise NumericalError(f"none of {len(evaluator.history)} points gives a number: {evaluator.history[-1].reason}")
    least_squares_from(evaluator, best.values)


def _search(evaluator: Evaluator, study: "Study", points: int) -> None:
    """Evaluate what the study holds, then ask it for more, up to ``points`` in all."""
    from optuna.trial import TrialState

    known = [trial for trial in study.get_trials(deepcopy=False) if trial.state != TrialState.WAITING]
    _replay(evaluator, study, known)
    if not study.get_trials(deepcopy=False):
        study.enqueue_trial({p.name: p.start for p in evaluator.problem.parameters})
    asked = len(known)
    while asked < points and not _met(evaluator):
        trials = [_asked(evaluator, study, asked + k) for k in range(min(BATCH, points - asked))]
        asked += len(trials)
        evaluations = evaluator.many([_point(evaluator, trial.params) for trial in trials])
        for trial, evaluation in zip(trials, evaluations, strict=True):
            _tell(evaluator, study, trial, evaluation)


def _replay(evaluator: Evaluator, study: "Study", known: Sequence["FrozenTrial"]) -> None:
    """Evaluate the trials of earlier calls again, which finds their runs, and tell of those that were under way."""
    from optuna.trial import Trial, TrialState

    drawn = [trial for trial in known if len(trial.params) == len(evaluator.problem.parameters)]
    evaluations = evaluator.many([_point(evaluator, trial.params) for trial in drawn])
    for trial, evaluation in zip(drawn, evaluations, strict=True):
        if trial.state == TrialState.RUNNING:
            _tell(evaluator, study, Trial(study, trial._trial_id), evaluation)
    for trial in known:
        if trial.state == TrialState.RUNNING and trial not in drawn:  # stopped while its values were drawn
            study.tell(trial.number, state=TrialState.FAIL)


def _asked(evaluator: Evaluator, study: "Study", number: int) -> "Trial":
    """A new trial with values; what is drawn at random depends on its ``number`` and the seed alone."""
    calibration, parameters = evaluator.problem.calibration, evaluator.problem.parameters
    study.sampler = _sampler(AT_RANDOM * len(parameters), [calibration.seed, number])
    trial = study.ask()
    for p in parameters:
        trial.suggest_float(p.name, p.low, p.high, log=p.log)
    return trial


def _sampler(at_random: int, seeds: Sequence[int]) -> "TPESampler":
    """Takes points that are under way for bad ones, so that a batch spreads."""
    from optuna.exceptions import ExperimentalWarning
    from optuna.samplers import TPESampler

    seed = int(np.random.SeedSequence(seeds).generate_state(1)[0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExperimentalWarning)
        return TPESampler(n_startup_trials=at_random, constant_liar=True, seed=seed)


def _point(evaluator: Evaluator, values: Mapping[str, float]) -> Point:
    """The point that is tried: the study's values with the digits of a calibration."""
    return tuple(p.value(p.position(values[p.name])) for p in evaluator.problem.parameters)


def _tell(evaluator: Evaluator, study: "Study", trial: "Trial", evaluation: Evaluation) -> None:
    """Write what came of a trial to the database."""
    if evaluation.good:
        study.tell(trial, cost(evaluator.problem.parameters, evaluation))
        return
    trial.set_user_attr("reason", evaluation.reason[:LONGEST_REASON])
    study.tell(trial, state=_lost_as(evaluation))


def _lost_as(evaluation: Evaluation) -> "TrialState":
    """Pruned what would come to the same again, which the sampler then avoids; failed what a machine may have done."""
    from optuna.trial import TrialState

    again = any(not r.settled and r.status != "timeout" for r in evaluation.records.values())
    return TrialState.FAIL if again else TrialState.PRUNED


def _met(evaluator: Evaluator) -> bool:
    """Tell whether a point meets all targets, and no prior pulls elsewhere."""
    tolerance = evaluator.problem.calibration.tolerance
    if any(p.prior for p in evaluator.problem.parameters):
        return False
    found = (one.deviations for one in evaluator.history)
    return any(d is not None and np.abs(d).max() <= tolerance for d in found)
