"""uncertainty.json, as it is written and as it is read again, whoever wrote it."""

from pydantic import BaseModel

from knittest.report_page.files import Number


class ParameterRow(BaseModel):
    """A parameter and its prior."""

    fields: list[str]
    unit: str = ""
    kind: str = ""
    low: Number = None
    high: Number = None
    mean: Number = None
    sd: Number = None
    reason: str = ""


class Index(BaseModel):
    """Indices of a variable to one parameter, with their 95 % intervals.

    Of a sample there is no total, and ``first`` is the coefficient of the regression of ranks, -1 to 1.
    """

    parameter: str
    first: Number = None
    first_interval: list[Number] = []
    total: Number = None
    total_interval: list[Number] = []


class VariableRow(BaseModel):
    """A quantity of a fabric or a ratio at one place: ``count`` of ``points`` of the prior gave a number, ``shortened``
    of these by runs to a shorter end.

    ``band`` is its 5, 50 and 95 % points, each with its interval in ``band_low`` and ``band_high``; empty where too
    few ran. ``indices`` is empty where ``no_indices`` says why; ``explained`` is what share of the variance of the
    ranks their regression explains, where it is one.
    """

    name: str
    quantity: str = ""
    who: str = ""
    ratio: bool = False
    at: Number = None
    axis: str = ""
    unit: str = ""
    log: bool = False
    count: int = 0
    points: int = 0
    shortened: int = 0
    band: list[Number] = []
    band_low: list[Number] = []
    band_high: list[Number] = []
    indices: list[Index] = []
    explained: Number = None
    no_indices: str = ""


class StatementRow(BaseModel):
    """An inequality and the share of the prior that it holds for, of the ``count`` points with all numbers.

    ``failing`` points lack a number and fail at a place that they have. ``possible`` is between which shares it lies,
    whatever the numbers that are missing would have been.
    """

    name: str
    text: str = ""
    holds: int = 0
    count: int = 0
    points: int = 0
    failing: int = 0
    share: Number = None
    interval: list[Number] = []
    possible: list[Number] = []


class Tried(BaseModel):
    """A run to a shorter end."""

    end: float
    status: str
    reason: str = ""
    trial: str = ""


class Lost(BaseModel):
    """A run that did not give every number, and where in the prior it was.

    ``counts_to`` is where the run ends that counts in its place, the last one ``tried``; None where none does.
    """

    point: int
    fabric: str
    status: str
    reason: str = ""
    values: dict[str, Number] = {}
    trial: str = ""
    counts_to: Number = None
    tried: list[Tried] = []


class ShorterRow(BaseModel):
    """Runs to the shorter ``end``."""

    end: float
    runs_by_status: dict[str, int] = {}


class Uncertainty(BaseModel):
    """uncertainty.json; the priors of the parameters are independent of each other."""

    uncertainty: str = ""
    status: str = ""
    test: str = ""
    setup: list[str] = []
    fabrics: dict[str, str] = {}
    differences: dict[str, list[object]] = {}
    design: str = "saltelli"
    samples: int = 0
    seed: int = 0
    points: int = 0
    runs: int = 0
    runs_by_status: dict[str, int] = {}
    lost_share: Number = None
    shorter_field: str = ""
    shorter_unit: str = ""
    shorter: list[ShorterRow] = []
    warnings: list[str] = []
    parameters: list[ParameterRow] = []
    variables: list[VariableRow] = []
    statements: list[StatementRow] = []
    lost: list[Lost] = []
    version: str = ""
    code: str = ""
    written: str = ""
