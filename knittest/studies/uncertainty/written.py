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
    """A quantity of a fabric or a ratio at one place: ``count`` of ``points`` of the prior gave a number.

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
    band: list[Number] = []
    band_low: list[Number] = []
    band_high: list[Number] = []
    indices: list[Index] = []
    explained: Number = None
    no_indices: str = ""


class StatementRow(BaseModel):
    """An inequality and the share of the prior that it holds for.

    ``possible`` is between which shares it lies, whatever the runs without a result would have given.
    """

    name: str
    text: str = ""
    holds: int = 0
    count: int = 0
    points: int = 0
    share: Number = None
    interval: list[Number] = []
    possible: list[Number] = []


class Lost(BaseModel):
    """A run without a result that counts, and where in the prior it was."""

    point: int
    fabric: str
    status: str
    reason: str = ""
    values: dict[str, Number] = {}
    trial: str = ""


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
    warnings: list[str] = []
    parameters: list[ParameterRow] = []
    variables: list[VariableRow] = []
    statements: list[StatementRow] = []
    lost: list[Lost] = []
    version: str = ""
    code: str = ""
    written: str = ""
