"""Types of the blocks of summary.json."""

from typing import Literal, NotRequired, TypedDict

Status = Literal["running", "completed", "failed", "interrupted"]


class Spread(TypedDict):
    """Result of an ensemble: mean, sample standard deviation (n - 1) and the value of each specimen."""

    mean: float
    sd: float
    values: list[float]


#: result: a number, None if JSON has no such number, or that of an ensemble
Value = float | Spread | None


class ComparisonRow(TypedDict):
    """Result compared with a published number.

    ``simulated``, mean and sd of the experiment are in the unit at the end of ``quantity``. ``deviation_sd`` is
    (simulated - mean) / sd, NaN without sd, ``deviation_pct`` the difference in percent of the mean. ``kind`` is
    predicted, tuned on this row, input or assumed; ``assumed`` are the assumed fields that decide it. ``scaled`` is the
    size for which the experiment was scaled; a ``given`` number was a setting of the run and has no deviation. For a
    specimen of whole yarns, ``simulated`` is the result ``modelled`` of each specimen times its own of ``factors``.
    """

    quantity: str
    simulated: float
    experiment_mean: float
    experiment_sd: float
    deviation_sd: float
    deviation_pct: float
    kind: str
    source: str
    assumed: NotRequired[list[str]]
    scaled: NotRequired[str]
    modelled: NotRequired[float]
    factors: NotRequired[list[float]]
    given: NotRequired[bool]


class Limit(TypedDict):
    """Limit looser than the preset's, and whether it was accepted."""

    name: str
    value: float
    preset: float
    unit: str
    accepted: bool


class CostBlock(TypedDict):
    """Times [s] and sizes of a run."""

    wall_s: float
    cpu_s: float
    compile_s: float
    steps: int
    elements: int
    element_steps_per_s: float
    threads: int


class NumericalError(TypedDict):
    """Changes [%] of a result in repeats, and its error in its own unit; None with the reason if unknown."""

    half_speed_pct: float | None
    coarser_mesh_pct: NotRequired[float | None]
    finer_mesh_pct: NotRequired[float | None]
    error: float | None
    reason: NotRequired[str]


class RepeatBlock(TypedDict, total=False):
    """Repeat of a run: changed setting, values, outcome and cost."""

    setting: str
    value: str
    other_value: str
    ratio: float
    finer: bool
    instead_of: str
    status: str
    reason: str
    folder: str
    wall_s: float | None
    cpu_s: float | None


class Verification(TypedDict):
    """Repeats of the first specimen."""

    specimen: int
    half_speed: NotRequired[RepeatBlock]
    mesh: NotRequired[RepeatBlock]


class UncheckedPeaks(TypedDict):
    """Strains [%] at first failure and at peak force, of ``specimens`` whose peak force comes later."""

    specimens: int
    first_failure_pct: list[float]
    peak_pct: list[float]


class Summary(TypedDict):
    """Contents of summary.json; ``results`` are folded (:func:`knittest.base.result_rows.fold_results`).

    ``kinds`` are those of results without reference, ``assumed`` the assumed inputs of the results (not in older runs).
    ``rest`` is the initial equilibrium of a meso test, folded; ``unjudged`` are peaks without quality checks (see
    :mod:`knittest.base.history`).
    """

    rig: str
    variant: str
    scale: str
    direction: str
    status: Status
    results: dict[str, object]
    quality: dict[str, float | bool]
    cost: CostBlock
    comparison: list[ComparisonRow]
    kinds: NotRequired[dict[str, str]]
    assumed: NotRequired[list[str]]
    refused: list[str]
    warnings: list[str]
    limits: list[Limit]
    rest: NotRequired[dict[str, object]]
    unjudged: NotRequired[UncheckedPeaks]
    numerical_error: NotRequired[dict[str, NumericalError]]
    verification: NotRequired[Verification]
