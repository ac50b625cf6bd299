"""Yarn cards from a data sheet: fibre and linear density to all numbers of a yarn, converted when a fabric is loaded.

Whatever a card states itself stays. A number that was derived before is derived again, so that it follows a change.
"""

import math
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from pydantic import BaseModel

from knittest.config.base import BoundsError, PerDirection, Quantity, check_bounds, field_meta

#: the reference of a derived number begins with this, and ends with the number and its unit
MARK = "yarn card: "
#: fields that only the conversion reads, and the number that replaces each when it is measured
SETTINGS = {
    "twist": "youngs_modulus", "packing": "beam_diameter", "efficiency": "fracture_strain",
    "bending_share": "bending_stiffness",
}  # fmt: skip
#: default of packing: fibre area over the area of the circle, of yarns without much twist in a fabric
PACKING = 0.6
#: default of bending_share: warps of Pham et al. (2019) have 0.0016 and 0.0026 by their cantilever tests
BENDING_SHARE = 0.002
#: steepest helix [deg] of a fibre on the surface of a twisted yarn
STEEPEST = 45.0
#: by how much shares may miss one, as they are rounded
SHARES = 0.01
_TEX = re.compile(r"\s*(?:(\d+)\s*[x×*]\s*)?(\d+(?:\.\d+)?)\s*(tex|dtex)?\s*$", re.IGNORECASE)


class Fibre(NamedTuple):
    """A row of ``fibres.yaml``: what a fibre is made of, in the units of its fields there."""

    density: float
    modulus: float
    failure_strain: float
    efficiency: float
    torsion_ratio: float
    filament_diameter: float
    source: str


class Blend(NamedTuple):
    """Fibres of a yarn with their shares by volume."""

    name: str
    parts: tuple[tuple[float, Fibre], ...]

    @property
    def density(self) -> float:
        """Mass over volume of the fibres [g/cm3]."""
        return sum(share * fibre.density for share, fibre in self.parts)

    @property
    def modulus(self) -> float:
        """Modulus of all fibres side by side [GPa]."""
        return sum(share * fibre.modulus for share, fibre in self.parts)

    @property
    def strength(self) -> float:
        """Strength of the filaments [GPa], each of its own failure strain: no yarn is stronger."""
        return sum(share * fibre.modulus * fibre.failure_strain for share, fibre in self.parts) / 100.0

    def failure(self, efficiency: float | None) -> tuple[Fibre, float]:
        """Fibre with whose failure the force is largest, and its strain [%] then; fibres that failed carry nothing."""
        ends = [(_end(fibre, efficiency), fibre) for _, fibre in self.parts]
        strain, first = max(ends, key=lambda end: end[0] * self.carriers(end[0], efficiency).modulus)
        return first, strain

    def carriers(self, strain: float, efficiency: float | None) -> "Blend":
        """Fibres that carry at ``strain`` [%]; their shares remain those of all fibres."""
        return Blend(self.name, tuple(part for part in self.parts if _end(part[1], efficiency) >= strain))


def _end(fibre: Fibre, efficiency: float | None) -> float:
    """Strain [%] at which ``fibre`` fails in a yarn."""
    return fibre.failure_strain * (fibre.efficiency if efficiency is None else efficiency)


@cache
def fibres() -> Mapping[str, Fibre]:
    """The shipped table of fibres by name."""
    rows = yaml.safe_load(Path(__file__).with_name("fibres.yaml").read_text(encoding="utf-8"))
    return {name: Fibre(**row) for name, row in rows.items()}


def blend_of(fibre: object) -> Blend:
    """The fibres that a card names, by name or by shares of mass; :class:`BoundsError` where it names none."""
    shares = {fibre: 1.0} if isinstance(fibre, str) else fibre
    if not isinstance(shares, Mapping) or not shares or not all(map(_is_share, shares.values())):
        raise BoundsError("expected the name of a fibre, or names with shares of mass above 0", "fibre")
    total = sum(shares.values())
    if abs(total - 1.0) > SHARES:
        raise BoundsError(f"the shares of mass add up to {total:g}, expected 1", "fibre")
    known = {_plain(name): (name, fibre) for name, fibre in fibres().items()}
    if missing := [name for name in shares if _plain(name) not in known]:
        raise BoundsError(
            f"{missing[0]} is not in the table of fibres, expected one of {', '.join(fibres())}; for another fibre "
            "state the numbers of the yarn instead",
            "fibre",
        )
    rows = [(share / total, *known[_plain(name)]) for name, share in shares.items()]
    volume = sum(share / fibre.density for share, _, fibre in rows)
    names = " and ".join(name if len(rows) == 1 else f"{100 * share:.3g} % {name}" for share, name, _ in rows)
    return Blend(names, tuple((share / fibre.density / volume, fibre) for share, _, fibre in rows))


def converted_card(card: object, model: type[BaseModel], usual: Mapping[str, tuple[float, str]]) -> Any:
    """``card`` of a yarn ``model``, filled where it names a fibre; ``usual`` are numbers that no data sheet has.

    Raises :class:`BoundsError` for what cannot be converted.
    """
    if not isinstance(card, Mapping):
        return card
    card = {**card, **_linear_density(card)}
    if card.get("fibre") is None:
        return {name: entry for name, entry in card.items() if name not in SETTINGS or _stated(entry) is not None}
    stated = {name: own for name, entry in card.items() if (own := _stated(entry)) is not None}
    for name, instead in SETTINGS.items():
        if name in stated and _is_whole(stated.get(instead)):
            raise BoundsError(f"excludes {instead}: keep the one that was measured", name)
    for name in ("linear_density", *SETTINGS):
        if (number := number_of(stated.get(name))) is not None:
            check_bounds(number, field_meta(model, name), name)
    directed = {name for name, info in model.model_fields.items() if info.annotation is PerDirection}
    found = {**_derived(stated), **{name: filled(value, "", why, "assumed") for name, (value, why) in usual.items()}}
    for name, entry in found.items():
        own = stated.get(name)
        if name not in directed:
            stated.setdefault(name, entry)
        elif not _is_whole(own):
            stated[name] = {"warp": entry, "weft": entry, **(own or {})}
    return stated


def _derived(stated: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Numbers that follow from the fibre, the linear density and what else is stated."""
    if (tex := number_of(stated.get("linear_density"))) is None:
        raise BoundsError("missing: mass per length of the yarn, in tex, such as 600 or 4 x 300 tex", "linear_density")
    blend = blend_of(stated["fibre"])
    found: dict[str, dict[str, Any]] = {}
    area = 1e-3 * tex / blend.density
    diameter = number_of(stated.get("beam_diameter"))
    if diameter is None or diameter <= 0.0:
        packing = number_of(stated.get("packing"))
        if packing is None:
            packing = PACKING
            found["packing"] = filled(packing, "", "fibre area over the area of the circle", "assumed")
        diameter = math.sqrt(4.0 * area / (math.pi * packing))
        found["beam_diameter"] = filled(
            diameter, "mm", f"sqrt(4 x {area:.4g} mm2 / (pi x packing {packing:g})), {tex:g} tex / {blend.density:.4g} "
            "g/cm3"
        )  # fmt: skip
    turned = _cosine_squared(number_of(stated.get("twist")) or 0.0, diameter)
    by_twist = "" if turned == 1.0 else f" x cos^2 of the helix on the surface {turned:.4g}"
    own = number_of(stated.get("efficiency"))
    first, strain = blend.failure(own)
    carriers = blend.carriers(strain, own)
    share = sum(v for v, _ in carriers.parts)
    found["load_area"] = filled(
        share * area, "mm2", f"{tex:g} tex / {blend.density:.4g} g/cm3 ({blend.name})"
        + ("" if len(carriers.parts) == len(blend.parts) else f" x {share:.3g}, the fibres that carry at failure")
    )  # fmt: skip
    found["youngs_modulus"] = filled(
        turned * carriers.modulus / share, "GPa", f"fibres side by side, {carriers.modulus / share:.4g} GPa{by_twist}"
    )
    if "fracture_strain" not in stated:
        if own is None:
            found["efficiency"] = filled(first.efficiency, "", "failure strain of the yarn over that of its filaments")
        found["fracture_strain"] = filled(
            strain, "%", f"efficiency {strain / first.failure_strain:g} x {first.failure_strain:g} % of the filaments"
        )
    if not _is_whole(stated.get("bending_stiffness")):
        found |= _bending(blend, area, diameter, number_of(stated.get("bending_share")))
    found["torsion_ratio"] = filled(
        sum(v * f.modulus * f.torsion_ratio for v, f in blend.parts) / blend.modulus, "", "2 G / E of the fibres"
    )
    return found


def _bending(blend: Blend, area: float, diameter: float, share: float | None) -> dict[str, dict[str, Any]]:
    """EI between the sum of the filaments' own, if they are free, and E A D^2 / 16, if they cannot slide."""
    found = {}
    if share is None:
        share = BENDING_SHARE
        why = "cantilever tests of two fabrics gave 0.0016 and 0.0026"
        found["bending_share"] = filled(share, "", why, "assumed")
    free = sum(v * f.modulus * (1e-3 * f.filament_diameter) ** 2 for v, f in blend.parts) * 1e3 * area / 16.0
    solid = 1e3 * blend.modulus * area * diameter**2 / 16.0
    formula = f"free filaments {free:.4g} + bending_share {share:g} x (solid {solid:.4g} - free)"
    return found | {"bending_stiffness": filled(free + share * (solid - free), "N mm2", formula)}


def _cosine_squared(twist: float, diameter: float) -> float:
    """cos^2 of the helix on the surface, by which twist lowers the modulus (Hearle, Grosberg, Backer, 1969)."""
    slope = math.pi * diameter * 1e-3 * twist
    if slope > math.tan(math.radians(STEEPEST)):
        most = 1e3 * math.tan(math.radians(STEEPEST)) / (math.pi * diameter)
        raise BoundsError(
            f"turns the fibres of a yarn of {diameter:.3g} mm by {math.degrees(math.atan(slope)):.0f} deg, expected at "
            f"most {STEEPEST:g} deg, {most:.4g} turns per metre",
            "twist",
        )
    return 1.0 / (1.0 + slope**2)


def _linear_density(card: Mapping[str, Any]) -> dict[str, Any]:
    """The linear density as a number, where it was written as plies or with its unit."""
    entry = card.get("linear_density")
    text = entry.get("value") if isinstance(entry, Mapping) else entry
    if not isinstance(text, str):
        return {}
    if not (found := _TEX.match(text)):
        raise BoundsError("expected a number in tex, or plies such as 4 x 300 tex", "linear_density")
    plies, each, unit = found.groups()
    value = int(plies or 1) * float(each) * (0.1 if (unit or "").lower() == "dtex" else 1.0)
    rest = entry if isinstance(entry, Mapping) else {"source": "user"}
    return {"linear_density": {**rest, "value": value, "ref": rest.get("ref") or text.strip()}}


def _stated(entry: Any) -> Any:
    """``entry`` of a card, none where this conversion filled it; of a pair of directions what is left."""
    if isinstance(entry, Mapping) and not isinstance(entry, Quantity) and {"warp", "weft"} & entry.keys():
        return {name: own for name, inner in entry.items() if (own := _stated(inner)) is not None} or None
    return None if is_filled(entry) else entry


def _is_whole(entry: Any) -> bool:
    """Tell whether ``entry`` of a card states its number, of a pair of directions both."""
    pair = isinstance(entry, Mapping) and bool({"warp", "weft"} & entry.keys())
    return {"warp", "weft"} <= entry.keys() if pair else entry is not None


def is_filled(entry: Any) -> bool:
    """Tell whether ``entry`` of a card was filled by this conversion and not edited since."""
    data = entry.model_dump() if isinstance(entry, Quantity) else entry
    if not isinstance(data, Mapping) or data.get("source") not in ("derived", "assumed"):
        return False
    ref, value = str(data.get("ref", "")), number_of(data)
    return ref.startswith(MARK) and value is not None and ref.rpartition(" = ")[2].split(" ")[0] == f"{value:.6g}"


def filled(value: float, unit: str, formula: str, source: str = "derived") -> dict[str, Any]:
    """Entry of a number that follows by ``formula``; :func:`is_filled` finds it again."""
    return {"value": value, "source": source, "ref": f"{MARK}{formula} = {value:.6g} {unit}".rstrip()}


def number_of(entry: Any) -> float | None:
    """Number of an entry of a card, none where it is no number."""
    value = entry.get("value") if isinstance(entry, Mapping) else getattr(entry, "value", entry)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _is_share(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and value > 0.0


def _plain(name: object) -> str:
    return re.sub(r"[\s_-]", "", str(name)).casefold()
