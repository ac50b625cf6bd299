"""Markdown of docs/acrylic-knits.md: from docs/knits.json, the measured curves and the shipped fabric files."""

from typing import Any

from docs import knits
from docs.generate_config import table
from docs.knits import COMPARED_AT, DEVIATION, DEVIATIONS, KNITS, LABELS, MODELS, deviations, measured
from knittest.config.loading import resolve

INTRO = f"""
# Acrylic knits

This page compares four knits of a soft acrylic yarn with measured tension curves of Singal et al. (2024), *Nature
Communications* 15, 2622. It is the only comparison of knittest with fabrics without inlays. One curve is:

```
knittest cell --variant acrylic-jersey --path weft --preset quick --set rig.max_strain=90 --set rig.max_force=0.22
```

`python -m docs.knits` repeats the whole study (hours on one core) and `python -m docs.generate` writes this page.

## What is compared

Each fabric was measured along the courses (weft) and along the wales (warp), four repeats each. Three models stand
beside each curve:

- **Cell, free to contract**: the periodic cell carries no force across the pull.
- **Cell, constant width**: the cell keeps its width. A specimen should lie between both cells.
- **Specimen between clamps**: a strip of the measured width and length. It is a macro model with a law of two strains
  that is derived from paths of the cell.

A curve agrees where at each of {", ".join(f"{at:g}" for at in COMPARED_AT)} N/mm the force at equal strain deviates by
at most {100.0 * DEVIATION:g} %, or the strain by at most {DEVIATIONS:g} standard deviations of the repeats.

## Inputs

| input | source |
|---|---|
| length of a loop | measured by the authors |
| bending stiffness 0.09 N mm² | the model of the authors; twice that of their cantilevers |
| rigidity and exponent of the shell | the model of the authors |
| outer and core diameter of the yarn | tuned by the authors, for each fabric anew |
| linear density, axial stiffness, torsion | assumed; they have no visible influence |
| friction | none, as in the authors' model |
| spacing of wales and courses | none: the relaxed fabric follows from the yarn |

The diameters were fitted to these fabrics. So agreement does not validate the diameters. Most curves of cells disagree:
specimens are wide and short, so that clamps hold a part of their width.
""".strip()
LIMITS = """
## How it works

Two soft yarns store an energy for each pair of points that are nearer than the outer diameter. It grows as a power
towards the core ([kernel](kernel.md#soft-yarns)). First the cell relaxes without friction and without mean stress: this
gives the spacings of the fabric. Then the cell is stretched row by row, and relaxed at each row. No inertia and no
damping is in the forces, and the speed has no influence: between 0.4 and 8 m/s the curve of the jersey changes by less
than 1 %.

The relaxed jersey has wales of 2.908 mm and courses of 2.095 mm. An independent minimisation of the same energy gives
2.919 and 2.089 mm with as many nodes.

## Limits

- Meso strips of these knits are not compared. Nothing binds the loops at their cut edges, so they unravel.
- The outer and core diameters differ from fabric to fabric although the yarn is one. No set of the yarn alone gives all
  four fabrics.
- Friction of the yarns is not known and taken as none.
- Beams at the preset `quick` are 0.58 (jersey), 0.65 (rib), 0.69 (garter) and 0.92 (seed) of the core long. Straight
  yarns that cross press each other within 10 % of the closed form at 0.55. So the seed is not independent of the mesh.
""".strip()


def knits_page() -> str:
    """The whole page."""
    stored = knits.load()
    return "\n\n".join([INTRO, "## Result", *_result(stored), *_fabrics(stored), LIMITS]) + "\n"


def _result(stored: dict[str, Any]) -> list[str]:
    rows, agree, compared = [], dict.fromkeys(MODELS, 0), dict.fromkeys(MODELS, 0)
    for knit in KNITS:
        for direction in ("weft", "warp"):
            cells = []
            for model in MODELS:
                cells.append(_verdict(knit, direction, stored, model))
                compared[model] += cells[-1] != "not run"
                agree[model] += cells[-1].startswith("agrees")
            rows.append([knit, direction, *cells])
    total = ", ".join(f"{LABELS[m]}: {agree[m]} of {compared[m]} agree" for m in MODELS if compared[m])
    text = "Range of the deviation of the force at equal strain, at the compared forces that both curves reach."
    return [text, table(("fabric", "along", *(LABELS[model] for model in MODELS)), rows), f"{total}."]


def _verdict(knit: str, direction: str, stored: dict[str, Any], model: str) -> str:
    curve = stored.get(knit, {}).get(direction, {}).get(model)
    if curve is None:
        return "not run"
    rows = deviations(measured(knit, direction), curve)
    known = [row.of_force for row in rows if row.of_force == row.of_force]
    span = f"{100.0 * min(known):+.0f} to {100.0 * max(known):+.0f} %" if known else "beyond the curve"
    verdict = "agrees" if all(row.agrees for row in rows) else "failed"
    return f"{'rejected by its quality checks' if curve['rejected'] else verdict}: {span}"


def _fabrics(stored: dict[str, Any]) -> list[str]:
    parts = []
    for knit in KNITS:
        fabric = resolve(variant=f"acrylic-{knit}").fabric
        shell = fabric.knitting.soft_shell
        assert shell is not None
        parts.append(f"### {fabric.title}")
        parts.append(
            f"Loops of {fabric.loop_length_mm:g} mm, outer diameter {shell.outer_diameter_mm:g} mm, core "
            f"{fabric.knitting.beam_diameter_mm:g} mm."
        )
        parts.append(f"![{knit}: measured and simulated force over strain](knits/{knit}.png)")
        head = ("along", "force [N/mm]", "measured strain", *(LABELS[model] for model in MODELS))
        rows = []
        for direction in ("weft", "warp"):
            found, curves = measured(knit, direction), stored.get(knit, {}).get(direction, {})
            for k, at in enumerate(COMPARED_AT):
                one = int(abs(found.force - at).argmin())
                strains = [
                    f"{deviations(found, curves[model])[k].simulated:.3f}".replace("nan", "-")
                    if model in curves else "-" for model in MODELS
                ]  # fmt: skip
                spread = f"{found.strain[one]:.3f} ± {found.deviation[one]:.3f}"
                rows.append([direction, f"{at:g}", spread, *strains])
        parts.append(table(head, rows))
    return parts
