"""State of rest that a test of yarns starts from, as results, tables and pages state it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from knittest.base.summary import Value

#: before the kind of a crossing: its mean normal force
FORCE = "normal_force_n."
#: how closely loops wrap each other (:mod:`knittest.models.wrap`)
WRAP = "loop_wrap"
#: Munden's constants K_c and K_s of relaxed plain knits (textbook values, apparel)
RELAXED = {"munden_kc": (5.0, 5.3), "munden_ks": (19.0, 21.6)}
#: label and format of each number
NUMBERS = {
    "draw_in_pct": ("loops drawn in by", "{:.3g} %"),
    "loop_tension_n": ("tension of the loops", "{:.3g} N"),
    FORCE: ("mean normal force of crossings", "{} N"),
    "thickness_mm": ("thickness", "{:.3f} mm"),
    "munden_kc": ("Munden's Kc", "{:.2f}"),
    "munden_ks": ("Munden's Ks", "{:.1f}"),
    WRAP: ("loops wrap to", "{:.3g} (1: straight and square, 0: closest points split)"),
    "out_of_balance_pct": ("out of balance", "{:.2g} % of the contact forces"),
}
#: wrap of loops below which they may snap: of 61 sheared cells at 0.05 or more one was lost by it, of 66 others 15
UNIQUE = 0.05
SPLITS = f"below {UNIQUE:.2f} a quarter of sheared cells snap and are refused: "
REMEDY = "take less draw-in or a longer loop"
#: of four cells that were lost by it at the speed and step of the study
RESCUED = "half the step let two of four such cells pass, half the speed one; else "
UNSETTLED = "not settled: yarns start free of force"
#: forces out of balance [%] above which numbers of rest are off by a tenth and more, not those of the test: settled on
#: from 2 % frames changed their tension by 0.2 %, from 5 and 53 % by 11 and 14 %, their forces by at most 0.9 %
CREEPING = 3.0
CREEPS = ": yarns creep, tension and crossings stated here may be off by a tenth and more, forces of frames by 1 %"


@dataclass(frozen=True)
class Rest:
    """Yarns at rest: mean axial force of the loops' yarn [N], thickness over the yarns' surfaces [mm], forces out of
    balance over those of contacts [-] (nan where nothing was settled), the mean normal force [N] of crossings that
    touch, by kind, and how closely loops ``wrap`` each other at most [-] (nan where none cross, or not known).
    """

    tension: float
    thickness: float
    residual: float
    normal_force: Mapping[str, float] = field(default_factory=dict)
    wrap: float = math.nan

    @property
    def warnings(self) -> tuple[str, ...]:
        """A warning of loops that wrap each other too closely for contacts at points."""
        return (f"loops wrap to {self.wrap:.3g}: {SPLITS}{REMEDY}",) if self.wrap < UNIQUE else ()

    @property
    def advice(self) -> str:
        """Remedy for a run whose motion or energies are off by that; empty where loops do not wrap so closely."""
        return f"loops wrap to {self.wrap:.3g}: {RESCUED}{REMEDY}" if self.wrap < UNIQUE else ""


def rest_numbers(rest: Rest, kc: float, ks: float, draw_in: float | None = None) -> dict[str, float]:
    """Numbers of ``rest`` by name with unit, with Munden's constants and a ``draw_in`` [-] of the loops."""
    drawn = {} if draw_in is None else {"draw_in_pct": 100.0 * draw_in}
    return drawn | {
        "loop_tension_n": rest.tension,
        **{f"{FORCE}{kind}": force for kind, force in sorted(rest.normal_force.items())},
        "thickness_mm": rest.thickness,
        "munden_kc": kc,
        "munden_ks": ks,
        **({} if math.isnan(rest.wrap) else {WRAP: rest.wrap}),
        "out_of_balance_pct": 100.0 * rest.residual,
    }


def of_all(specimens: Sequence[Mapping[str, float]]) -> list[dict[str, float]]:
    """The numbers of ``specimens`` with the same names in all: a kind of crossing that none of one touches has 0 N."""
    names = dict.fromkeys(name for one in specimens for name in one)
    return [{name: one.get(name, 0.0 if name.startswith(FORCE) else math.nan) for name in names} for one in specimens]


def rest_rows(numbers: Mapping[str, Value]) -> list[tuple[str, str]]:
    """Label and text of each of ``numbers``, flat as :func:`rest_numbers` has them, or with their spread."""
    means = {name: _mean(value) for name, value in numbers.items()}
    found = []
    for name, (label, text) in NUMBERS.items():
        if name == FORCE:
            forces = [f"{key.removeprefix(FORCE)} {force:.3g}" for key, force in means.items() if key.startswith(FORCE)]
            found += [(label, text.format(", ".join(forces)))] if forces else []
        elif name in means:
            found.append((label, _told(name, text, means[name])))
    return found


def rest_line(numbers: Mapping[str, Value]) -> str:
    """Tension of the loops, their wrap, thickness and how far they are settled: what of it a terminal shows."""
    means = {name: _mean(value) for name, value in numbers.items()}
    tension, thickness, residual = (means[n] for n in ("loop_tension_n", "thickness_mm", "out_of_balance_pct"))
    share = f"{residual:.0f}" if residual >= 10.0 else f"{residual:.2g}"
    state = f"out of balance {share} %" if math.isfinite(residual) else "not settled"
    doubt = " (yarns still creep: the tension may be off by a tenth or more)" if residual > CREEPING else ""
    wrap = f", wrap {means[WRAP]:.2g}" if math.isfinite(means.get(WRAP, math.nan)) else ""
    return f"loops {tension:.2g} N{wrap}, {thickness:.2f} mm thick, {state}{doubt}"


def _mean(value: Value) -> float:
    """A number, or the mean of those of an ensemble; nan where JSON has none."""
    if isinstance(value, Mapping):
        value = value["mean"]
    return math.nan if value is None else float(value)


def _told(name: str, text: str, value: float) -> str:
    if not math.isfinite(value):
        return UNSETTLED if name == "out_of_balance_pct" else "unknown"
    if name == "out_of_balance_pct" and value > CREEPING:
        return text.format(value) + CREEPS
    if name == WRAP and value < UNIQUE:
        return f"{text.format(value)}; {SPLITS}{REMEDY}"
    low, high = RELAXED.get(name, (0.0, 0.0))
    return text.format(value) + (f" (relaxed plain knits {low:g} to {high:g})" if high else "")
