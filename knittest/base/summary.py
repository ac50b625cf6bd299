"""Blocks of summary.json as types: what a run writes is what tables, pages and studies read."""

from typing import Literal, NotRequired, TypedDict

Status = Literal["running", "completed", "failed", "interrupted"]


class Spread(TypedDict):
    """A result of an ensemble: mean, sample standard deviation (n - 1) and the value of each specimen."""

    mean: float
    sd: float
    values: list[float]


#: a result: a number, None where JSON has no such number, or that of an ensemble
Value = float | Spread | None


class ComparisonRow(TypedDict):
    """One result against one published number.

    ``simulated``, the experiment's mean and sd are in the unit that ``quantity`` ends with; ``deviation_sd`` is
    (simulated - mean) / sd, NaN where no sd is stated, ``deviation_pct`` the same difference in percent of the mean;
    ``kind`` says whether the simulated number is a prediction, was tuned on this row, only reproduces its input, or is
    assumed; ``assumed`` are the fields that decide it and that nobody vouches for; ``scaled``
    says for which size the experiment was scaled, if it was; a ``given`` number was the run's own setting and has no
    deviation. A specimen of whole yarns is not as large as its nominal size: ``simulated`` is then the result
    ``modelled`` of each specimen times its own of ``factors``.
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
    """A limit looser than the preset's, and whether that was accepted."""

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
    """Changes [%] of a result by its repeats, and its error in its own unit; None with the reason where not known."""

    half_speed_pct: float | None
    coarser_mesh_pct: NotRequired[float | None]
    finer_mesh_pct: NotRequired[float | None]
    error: float | None
    reason: NotRequired[str]


class RepeatBlock(TypedDict, total=False):
    """A repeat of a run: what was changed, from what to what, how it ended and what it cost."""

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


class Unjudged(TypedDict):
    """Strains [%] at first failure and at the largest force, of those of ``specimens`` whose peak lies beyond it."""

    specimens: int
    first_failure_pct: list[float]
    peak_pct: list[float]


class Summary(TypedDict):
    """summary.json of a run; ``results`` are folded (:func:`knittest.base.result_rows.folded`).

    ``kinds`` are those of results without a reference, ``assumed`` the inputs that decide the results; older runs have
    neither. ``rest`` is the state that a test of yarns started from (:mod:`knittest.base.history`), folded too;
    ``unjudged`` are peaks that the gates do not reach (:mod:`knittest.base.history`).
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
    unjudged: NotRequired[Unjudged]
    numerical_error: NotRequired[dict[str, NumericalError]]
    verification: NotRequired[Verification]
