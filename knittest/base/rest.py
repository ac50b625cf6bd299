"""State of rest that a test of yarns starts from, as results, tables and pages state it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from knittest.base.summary import Value

#: before the kind of a crossing: its mean normal force
FORCE = "normal_force_n."
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
    "out_of_balance_pct": ("out of balance", "{:.2g} % of the contact forces"),
}
UNSETTLED = "not settled: yarns start free of force"
#: forces out of balance [%] above which numbers of rest are off by a tenth and more, not those of the test: settled on
#: from 2 % frames changed their tension by 0.2 %, from 5 and 53 % by 11 and 14 %, their forces by at most 0.9 %
CREEPING = 3.0
CREEPS = ": yarns creep, tension and crossings stated here may be off by a tenth and more, forces of frames by 1 %"


@dataclass(frozen=True)
class Rest:
    """Yarns at rest: mean axial force of the loops' yarn [N], thickness over the yarns' surfaces [mm], forces out of
    balance over those of contacts [-] (nan where nothing was settled), and the mean normal force [N] of crossings that
    touch, by kind.
    """

    tension: float
    thickness: float
    residual: float
    normal_force: Mapping[str, float] = field(default_factory=dict)


def rest_numbers(rest: Rest, kc: float, ks: float, draw_in: float | None = None) -> dict[str, float]:
    """Numbers of ``rest`` by name with unit, with Munden's constants and a ``draw_in`` [-] of the loops."""
    drawn = {} if draw_in is None else {"draw_in_pct": 100.0 * draw_in}
    return drawn | {
        "loop_tension_n": rest.tension,
        **{f"{FORCE}{kind}": force for kind, force in sorted(rest.normal_force.items())},
        "thickness_mm": rest.thickness,
        "munden_kc": kc,
        "munden_ks": ks,
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
    """Tension of the loops, thickness and how far they are settled: the part of it that a terminal shows."""
    means = {name: _mean(value) for name, value in numbers.items()}
    tension, thickness, residual = (means[n] for n in ("loop_tension_n", "thickness_mm", "out_of_balance_pct"))
    state = f"out of balance {residual:.2g} %" if math.isfinite(residual) else "not settled"
    doubt = ": tension good to a tenth at best" if residual > CREEPING else ""
    return f"loops {tension:.2g} N, {thickness:.2f} mm thick, {state}{doubt}"


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
    low, high = RELAXED.get(name, (0.0, 0.0))
    return text.format(value) + (f" (relaxed plain knits {low:g} to {high:g})" if high else "")
