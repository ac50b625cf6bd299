"""Yarn cards from a data sheet: all numbers of a yarn from fibre and linear density, when a fabric is loaded.

Numbers of the card itself stay. A derived number is derived again at each loading, so that it follows a change.
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

#: beginning of the reference of a derived number, which ends with the number and its unit
MARK = "yarn card: "
#: fields that only the conversion reads, with the measured number that replaces each
SETTINGS = {
    "twist": "youngs_modulus", "packing": "beam_diameter", "efficiency": "fracture_strain",
    "bending_share": "bending_stiffness",
}  # fmt: skip
#: default of packing: fibre area over the area of the circle, of yarns with little twist in a fabric
PACKING = 0.6
#: default of bending_share; cantilever tests of the warps of Pham et al. (2019) give 0.0016 and 0.0026
BENDING_SHARE = 0.002
#: largest helix angle [deg] of a fibre at the surface of a twisted yarn
STEEPEST = 45.0
#: tolerance of the sum of mass fractions
SHARES = 0.01
_TEX = re.compile(r"\s*(?:(\d+)\s*[x×*]\s*)?(\d+(?:\.\d+)?)\s*(tex|dtex)?\s*$", re.IGNORECASE)


class Fibre(NamedTuple):
    """Properties of a fibre in ``fibres.yaml``, in the units given there."""

    density: float
    modulus: float
    failure_strain: float
    efficiency: float
    torsion_ratio: float
    filament_diameter: float
    source: str


class Blend(NamedTuple):
    """Fibres of a yarn with their volume fractions."""

    name: str
    parts: tuple[tuple[float, Fibre], ...]

    @property
    def density(self) -> float:
        """Density of the fibres [g/cm3]."""
        return sum(share * fibre.density for share, fibre in self.parts)

    @property
    def modulus(self) -> float:
        """Modulus of all fibres in parallel [GPa]."""
        return sum(share * fibre.modulus for share, fibre in self.parts)

    @property
    def strength(self) -> float:
        """Strength of the filaments [GPa], each at its own failure strain; an upper bound for the yarn."""
        return sum(share * fibre.modulus * fibre.failure_strain for share, fibre in self.parts) / 100.0

    def failure(self, efficiency: float | None) -> tuple[Fibre, float]:
        """Fibre whose failure ends the largest force, and its failure strain [%]; failed fibres carry nothing."""
        ends = [(_failure_strain(fibre, efficiency), fibre) for _, fibre in self.parts]
        strain, first = max(ends, key=lambda end: end[0] * self.carriers(end[0], efficiency).modulus)
        return first, strain

    def carriers(self, strain: float, efficiency: float | None) -> "Blend":
        """Fibres that carry at ``strain`` [%], with fractions of all fibres."""
        return Blend(self.name, tuple(part for part in self.parts if _failure_strain(part[1], efficiency) >= strain))


def _failure_strain(fibre: Fibre, efficiency: float | None) -> float:
    """Failure strain [%] of ``fibre`` in a yarn."""
    return fibre.failure_strain * (fibre.efficiency if efficiency is None else efficiency)


@cache
def fibres() -> Mapping[str, Fibre]:
    """Shipped table of fibres by name."""
    rows = yaml.safe_load(Path(__file__).with_name("fibres.yaml").read_text(encoding="utf-8"))
    return {name: Fibre(**row) for name, row in rows.items()}


def blend_of(fibre: object) -> Blend:
    """Fibres of a card, by name or by mass fractions; raises :class:`BoundsError` for unknown ones."""
    shares = {fibre: 1.0} if isinstance(fibre, str) else fibre
    if (
        not isinstance(shares, Mapping)
        or not shares
        or any(
            isinstance(share, bool) or not isinstance(share, int | float) or share <= 0.0 for share in shares.values()
        )
    ):
        raise BoundsError("expected the name of a fibre, or names with mass fractions above 0", "fibre")
    total = sum(shares.values())
    if abs(total - 1.0) > SHARES:
        raise BoundsError(f"the mass fractions add up to {total:g}, expected 1", "fibre")
    known = {_normalised_name(name): (name, fibre) for name, fibre in fibres().items()}
    if missing := [name for name in shares if _normalised_name(name) not in known]:
        raise BoundsError(
            f"unknown fibre {missing[0]}, expected one of {', '.join(fibres())}; for another fibre give the numbers of "
            "the yarn instead",
            "fibre",
        )
    rows = [(share / total, *known[_normalised_name(name)]) for name, share in shares.items()]
    volume = sum(share / fibre.density for share, _, fibre in rows)
    names = " and ".join(name if len(rows) == 1 else f"{100 * share:.3g} % {name}" for share, name, _ in rows)
    return Blend(names, tuple((share / fibre.density / volume, fibre) for share, _, fibre in rows))


def fill_yarn_card(card: object, model: type[BaseModel], usual: Mapping[str, tuple[float, str]]) -> Any:
    """Fill the ``card`` of a yarn ``model`` that names a fibre, with ``usual`` numbers; :class:`BoundsError`."""
    if not isinstance(card, Mapping):
        return card
    card = {**card, **_linear_density(card)}
    if card.get("fibre") is None:
        return {name: entry for name, entry in card.items() if name not in SETTINGS or _own_entry(entry) is not None}
    stated = {name: own for name, entry in card.items() if (own := _own_entry(entry)) is not None}
    for name, instead in SETTINGS.items():
        if name in stated and _is_whole(stated.get(instead)):
            raise BoundsError(f"excludes {instead}: keep the one that was measured", name)
    for name in ("linear_density", *SETTINGS):
        if (number := number_of(stated.get(name))) is not None:
            check_bounds(number, field_meta(model, name), name)
    directed = {name for name, info in model.model_fields.items() if info.annotation is PerDirection}
    found = {
        **_derive(stated),
        **{name: derived_entry(value, "", why, "assumed") for name, (value, why) in usual.items()},
    }
    for name, entry in found.items():
        own = stated.get(name)
        if name not in directed:
            stated.setdefault(name, entry)
        elif not _is_whole(own):
            stated[name] = {"warp": entry, "weft": entry, **(own or {})}
    return stated


def _derive(stated: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Numbers that follow from fibre, linear density and other numbers of the card."""
    if (tex := number_of(stated.get("linear_density"))) is None:
        raise BoundsError("missing: mass per length of the yarn, such as 600 or 4 x 300 tex", "linear_density")
    blend = blend_of(stated["fibre"])
    found: dict[str, dict[str, Any]] = {}
    area = 1e-3 * tex / blend.density
    diameter = number_of(stated.get("beam_diameter"))
    if diameter is None or diameter <= 0.0:
        packing = number_of(stated.get("packing"))
        if packing is None:
            packing = PACKING
            found["packing"] = derived_entry(packing, "", "fibre area over the area of the circle", "assumed")
        diameter = math.sqrt(4.0 * area / (math.pi * packing))
        found["beam_diameter"] = derived_entry(
            diameter, "mm", f"sqrt(4 x {area:.4g} mm2 / (pi x packing {packing:g})), {tex:g} tex / {blend.density:.4g} "
            "g/cm3"
        )  # fmt: skip
    turned = _cosine_squared(number_of(stated.get("twist")) or 0.0, diameter)
    by_twist = "" if turned == 1.0 else f" x cos^2 of the helix angle at the surface {turned:.4g}"
    own = number_of(stated.get("efficiency"))
    first, strain = blend.failure(own)
    carriers = blend.carriers(strain, own)
    share = sum(v for v, _ in carriers.parts)
    found["load_area"] = derived_entry(
        share * area, "mm2", f"{tex:g} tex / {blend.density:.4g} g/cm3 ({blend.name})"
        + ("" if len(carriers.parts) == len(blend.parts) else f" x {share:.3g}, the fibres that carry at failure")
    )  # fmt: skip
    found["youngs_modulus"] = derived_entry(
        turned * carriers.modulus / share, "GPa", f"fibres in parallel, {carriers.modulus / share:.4g} GPa{by_twist}"
    )
    if "fracture_strain" not in stated:
        if own is None:
            found["efficiency"] = derived_entry(
                first.efficiency, "", "failure strain of the yarn over that of its filaments, of the table of fibres, "
                f"not measured on this yarn ({first.source})", "assumed",
            )  # fmt: skip
        found["fracture_strain"] = derived_entry(
            strain, "%", f"efficiency {strain / first.failure_strain:g} x {first.failure_strain:g} % of the filaments"
        )
    if not _is_whole(stated.get("bending_stiffness")):
        found |= _derive_bending(blend, area, diameter, number_of(stated.get("bending_share")))
    found["torsion_ratio"] = derived_entry(
        sum(v * f.modulus * f.torsion_ratio for v, f in blend.parts) / blend.modulus, "", "2 G / E of the fibres"
    )
    return found


def _derive_bending(blend: Blend, area: float, diameter: float, share: float | None) -> dict[str, dict[str, Any]]:
    """EI between that of free filaments and E A D^2 / 16 of filaments that cannot slide."""
    found = {}
    if share is None:
        share = BENDING_SHARE
        why = "cantilever tests of two fabrics gave 0.0016 and 0.0026"
        found["bending_share"] = derived_entry(share, "", why, "assumed")
    free = sum(v * f.modulus * (1e-3 * f.filament_diameter) ** 2 for v, f in blend.parts) * 1e3 * area / 16.0
    solid = 1e3 * blend.modulus * area * diameter**2 / 16.0
    formula = f"free filaments {free:.4g} + bending_share {share:g} x (solid {solid:.4g} - free)"
    return found | {"bending_stiffness": derived_entry(free + share * (solid - free), "N mm2", formula)}


def _cosine_squared(twist: float, diameter: float) -> float:
    """Factor cos^2 of the helix angle at the surface, by which twist lowers the modulus (Hearle et al., 1969)."""
    slope = math.pi * diameter * 1e-3 * twist
    if slope > math.tan(math.radians(STEEPEST)):
        most = 1e3 * math.tan(math.radians(STEEPEST)) / (math.pi * diameter)
        raise BoundsError(
            f"gives a helix angle of {math.degrees(math.atan(slope)):.0f} deg at the surface of a yarn of "
            f"{diameter:.3g} mm, expected at most {STEEPEST:g} deg, {most:.4g} turns per metre",
            "twist",
        )
    return 1.0 / (1.0 + slope**2)


def _linear_density(card: Mapping[str, Any]) -> dict[str, Any]:
    """Linear density as a number, if it was written as plies or with its unit."""
    entry = card.get("linear_density")
    text = entry.get("value") if isinstance(entry, Mapping) else entry
    if not isinstance(text, str):
        return {}
    if not (found := _TEX.match(text)):
        raise BoundsError(
            "expected a number in tex, a text such as 50 tex or 500 dtex, or plies such as 4 x 300 tex",
            "linear_density",
        )
    plies, each, unit = found.groups()
    value = int(plies or 1) * float(each) * (0.1 if (unit or "").lower() == "dtex" else 1.0)
    rest = entry if isinstance(entry, Mapping) else {"source": "user"}
    return {"linear_density": {**rest, "value": value, "ref": rest.get("ref") or text.strip()}}


def _own_entry(entry: Any) -> Any:
    """Entry of a card without numbers that this conversion filled; None if nothing is left."""
    if isinstance(entry, Mapping) and not isinstance(entry, Quantity) and {"warp", "weft"} & entry.keys():
        return {name: own for name, inner in entry.items() if (own := _own_entry(inner)) is not None} or None
    return None if is_filled(entry) else entry


def _is_whole(entry: Any) -> bool:
    """Tell whether ``entry`` of a card has its number, or those of both directions."""
    pair = isinstance(entry, Mapping) and bool({"warp", "weft"} & entry.keys())
    return {"warp", "weft"} <= entry.keys() if pair else entry is not None


def is_filled(entry: Any) -> bool:
    """Tell whether ``entry`` of a card was filled by this conversion and not edited since."""
    data = entry.model_dump() if isinstance(entry, Quantity) else entry
    if not isinstance(data, Mapping) or data.get("source") not in ("derived", "assumed"):
        return False
    ref, value = str(data.get("ref", "")), number_of(data)
    return ref.startswith(MARK) and value is not None and ref.rpartition(" = ")[2].split(" ")[0] == f"{value:.6g}"


def derived_entry(value: float, unit: str, formula: str, source: str = "derived") -> dict[str, Any]:
    """Entry of a number derived by ``formula``; :func:`is_filled` recognises it."""
    return {"value": value, "source": source, "ref": f"{MARK}{formula} = {value:.6g} {unit}".rstrip()}


def number_of(entry: Any) -> float | None:
    """Number of an entry of a card; None if it is no number."""
    value = entry.get("value") if isinstance(entry, Mapping) else getattr(entry, "value", entry)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _normalised_name(name: object) -> str:
    return re.sub(r"[\s_-]", "", str(name)).casefold()
