"""Markdown of docs/structures.md: from docs/structures.json and the shipped fabric files."""

from docs import structures as stored_structures
from docs.generate_config import table
from docs.structures import INLAYS, LOOPS, StoredStructure
from knittest.base.files import structures
from knittest.config.fabric import Fabric
from knittest.config.loading import resolve
from knittest.config.structure import DIRECTIONS

INTRO = """
# Structures

A fabric is a grid of stitches with layers of inlays. This page explains both and shows the shipped structures. A new
fabric starts from one of them:

```
knittest new my-weft --structure weft-only
knittest fabric show --variant my-weft
```

`fabric show` draws face, back, an oblique view and two sections to `fabric.png` (`--out` for another file).

## Stitches

`stitches` lists the courses of one repeat, first course first. Each course is a row of `k` and `p`. A knit stitch (`k`)
is pulled through the loop below towards the face, a purl stitch (`p`) towards the back. `[k]` is plain jersey, `[kp]`
rib 1x1, `[k, p]` garter and `[kp, pk]` seed.

## Layers

`layers` lists the layers of inlays **from back to face**:

- `direction`: `warp` inlays lie along the wales, `weft` inlays along the courses.
- `pattern`: the wales (of a warp) or courses (of a weft) with an inlay (`x`) and without (`.`). `x.` is every second
  one, `x` (the default) each one.
- `yarn`: a [yarn card](yarn-card.md) for this layer. Without it the layer consists of the yarn `reinforcing`.

`layers: []` means no inlays. A file without `layers` has a warp in every wale behind a weft in every course.

**Names.** The loops are the yarn system `knit`. A layer is called `warp` or `weft`, or `warp1`, `warp2` from back to
face where a direction has several layers. Tables, energies, pictures, decks and meshes use these names.

**Settings.** Layers are counted from 0, at the back. `--set fabric.layers.0.yarn.youngs_modulus=70` changes a layer
with a yarn of its own. The other layers follow `--set fabric.reinforcing.youngs_modulus=70`.

**Densities.** `warp_density` counts the wales and `weft_density` the courses in 100 mm, with or without inlays. The
density of the inlays follows from `pattern`: `x.` in 28 wales gives 14 inlays in 100 mm.

**Specimens.** Strips, squares and frames of yarns have whole repeats of a pattern across their inlays. A pattern `x.`
in 25 mm gives 6 or 8 wales. So each specimen has the inlay density of the fabric.

## What holds an inlay

Each inlay needs something in front of it and behind it: a loop, or an inlay that is held on this side itself.
Otherwise it falls out.

- Legs of knit stitches lie in front of the wefts, legs of purl stitches behind them. They do not cross the warps.
- Sinker arcs of a plain knit lie behind the warps, but not behind the wefts.
- So nothing lies behind a weft alone in a plain knit. Rib holds it, or a warp behind it.
- Nothing lies in front of a warp alone in a plain knit. Garter holds it, or a weft in front of it.

After the relaxation knittest checks each inlay and each crossing. An error message names the inlay that is loose.

## What is not modelled

- Interlock, tuck and miss stitches, and transferred loops.
- Inlays that leave their wale or course.
- Repeats of more than 8 wales or courses.
""".strip()
SHIPPED = f"""
## Shipped structures

All numbers of these files are assumed. `python -m docs.structures` runs for each structure and direction:

```
knittest cell --variant NAME --preset quick --path warp --set rig.max_strain={INLAYS:g} \\
  --set rig.transverse=held --set rig.at_fracture=ends
```

Where no inlays lie along the load, the strain ends at {LOOPS["warp"]:g} % along the warp and {LOOPS["weft"]:g} % along
the weft. The cell keeps its length across. No measurements of these fabrics exist, so the curves are predictions
without a comparison. Thickness and area mass are those of the relaxed cell. The blocks
below lack the `name` of a fabric file; the command at the top of this page writes a whole file.
""".strip()


def structures_page() -> str:
    """The whole page."""
    stored = stored_structures.load()
    fabrics = {name: resolve(variant=name).fabric for name in structures()}
    head = ("structure", "stitches", "layers, back to face", "thickness [mm]", "area mass [g/m²]")
    rows = [_row(name, fabric, stored[name]) for name, fabric in fabrics.items()]
    parts = [INTRO, SHIPPED, table(head, rows)]
    for name, fabric in fabrics.items():
        parts += [f"### {name}", f"{fabric.title}.", f"```yaml\n{_fields(name)}\n```", *_pictures(name, stored[name])]
    return "\n\n".join(parts) + "\n"


def _row(name: str, fabric: Fabric, stored: StoredStructure) -> list[str]:
    layers = [f"{one.name} {''.join('.x'[k] for k in one.pattern)}" for one in fabric.inlays]
    return [
        f"[{name}](#{name})", f"`[{', '.join(fabric.stitches)}]`", ", ".join(layers) or "none",
        f"{stored.thickness_mm:.2f}", f"{stored.area_mass_g_m2:.0f}",
    ]  # fmt: skip


def _fields(name: str) -> str:
    """Fields of a structure's file, without comments, name and title."""
    lines = structures()[name].read_text(encoding="utf-8").splitlines()
    return "\n".join(line.partition("  #")[0] for line in lines if not line.startswith(("#", "name:", "title:")))


def _pictures(name: str, stored: StoredStructure) -> list[str]:
    text = [f"![{name}: face, back, oblique view and sections](structures/{name}.png)"]
    text.append(f"![{name}: force per width over strain along warp and weft](structures/{name}-curves.png)")
    rejected = [direction for direction in DIRECTIONS if direction in stored.rejected]
    return text + [f"The curve along the {one} is rejected: {stored.rejected[one].split('; ')[0]}." for one in rejected]
