"""calibration.json as it is read again, whoever wrote it."""

from pydantic import BaseModel

from knittest.report_page.files import Number


class ParameterRow(BaseModel):
    """A parameter of calibration.json."""

    fields: list[str]
    unit: str = ""
    low: Number = None
    high: Number = None
    prior_mean: Number = None
    prior_sd: Number = None
    before: Number = None
    before_source: str = ""
    value: Number = None
    interval_95: list[float] | None = None
    sensitivity_sd: Number = None


class TargetRow(BaseModel):
    """A target of calibration.json; ``quantity``, ``mean`` and ``sd`` are those of a number."""

    target: str
    test: str = ""
    weight: float = 1.0
    source: str = ""
    quantity: str = ""
    mean: Number = None
    sd: Number = None
    simulated: Number = None
    deviation_sd: Number = None


class Point(BaseModel):
    """A point of the search: the keys of its ``trials`` by test."""

    number: int
    values: list[float]
    simulated: list[Number] | None = None
    reason: str = ""
    trials: dict[str, str] = {}


class Calibration(BaseModel):
    """calibration.json."""

    calibration: str = ""
    status: str = ""
    reason: str = ""
    method: str = ""
    parameters: list[ParameterRow] = []
    targets: list[TargetRow] = []
    rms_deviation_sd: Number = None
    warnings: list[str] = []
    runs: int = 0
    runs_by_status: dict[str, int] = {}
    evaluations: list[Point] = []
    version: str = ""
    code: str = ""
    written: str = ""

    @property
    def best(self) -> Point | None:
        """The point of the values that were found."""
        values = [row.value for row in self.parameters]
        return next((one for one in self.evaluations if one.values == values), None)
