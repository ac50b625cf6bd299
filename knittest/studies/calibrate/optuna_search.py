"""A search by Optuna's tree-structured Parzen estimator (Bergstra et al., 2011), its trials kept in a database."""

import math
import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from knittest.base.errors import NumericalError
from knittest.studies.calibrate.evaluate import Evaluation, Evaluator, Exhausted, Point
from knittest.studies.calibrate.fit import GLOBAL_SHARE, best_of, cost, least_squares_from
from knittest.studies.calibrate.optuna_storage import readable

if TYPE_CHECKING:
    from optuna import Study
    from optuna.samplers import TPESampler
    from optuna.trial import FrozenTrial, Trial, TrialState

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
