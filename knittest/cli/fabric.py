"""``knittest fabric``: relaxed geometry of a fabric, its picture and its centre-lines."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from knittest.cli.options import FABRIC, FILE, PARAMETERS, VARIANT, add_options

if TYPE_CHECKING:
    from knittest.config.run import Run
    from knittest.fabric.cell import Cell


#: options that choose a fabric
_fabric_options = add_options(
    VARIANT,
    FABRIC,
    PARAMETERS,
    click.option("--set", "sets", multiple=True, metavar="KEY=VALUE", help="Change a field: fabric.loop_length=14."),
)


@click.group()
def fabric() -> None:
    """Relax, draw or export the yarn geometry of a fabric."""


@fabric.command()
@_fabric_options
def relax(**which: Any) -> None:
    """Relax one cell of the fabric, check its interlacing and store it for the simulations.

    Example: knittest fabric relax --variant 1
    """
    from knittest.fabric.cell import Munden, cell_path

    run, cell, seconds = _relax(**which)
    stated, knit = run.fabric.thickness, run.fabric.knitting
    scatter = f" ± {stated.sd:g}" if stated.sd else ""
    thickness = cell.thickness + knit.loose_fibres_mm
    rows = (
        ("fabric", run.fabric.name),
        ("cell", f"{cell.spec.size[0]:.4f} x {cell.spec.size[1]:.4f} mm"),
        *_relaxed_rows(run),
        ("thickness", f"{thickness:.3f} mm ({stated.source} {stated.value:g}{scatter} mm)"),
        ("loop length", f"{cell.spec.loop_length:g} mm, met within {100 * abs(cell.length_error):.3f} %"),
        ("Munden's Kc, Ks", str(Munden.of(cell.spec))),
        *((f"crimp {one.name}", f"{100 * cell.crimp(one.name):.3f} %") for one in cell.spec.layers),
        *(() if run.fabric.has_soft_yarns else _relaxation_rows(cell)),
        ("time", "from the cache" if seconds is None else f"{seconds:.2f} s"),
        *(() if run.fabric.has_soft_yarns else (("stored in", str(cell_path(cell.spec))),)),
        *_equilibrium_rows(run),
    )
    wide = max(len(name) for name, _ in rows) + 2
    for name, text in rows:
        click.echo(f"{name:{wide}}{text}")


@fabric.command()
@_fabric_options
@click.option("--out", type=FILE, default=Path("fabric.png"), show_default=True)
def show(out: Path, **which: Any) -> None:
    """Draw 4 x 4 cells: technical face, technical back, an oblique view and two sections (PNG).

    Example: knittest fabric show --variant 2 --out variant2.png
    """
    from knittest.base.figure import Stamp, use_stamp
    from knittest.export.yarn_pictures import cell_picture

    run, cell, _ = _relax(**which)
    name, size = run.fabric.name, f"4 x 4 cells of {cell.spec.wale:.3f} x {cell.spec.course:.3f} mm"
    loops = f"loop length {cell.spec.loop_length:g} mm"
    with use_stamp(Stamp((name, f"parameters {run.parameters}", size, loops))):
        cell_picture(out, cell, name)
    click.echo(str(out))


@fabric.command()
@_fabric_options
@click.argument("file", type=FILE)
@click.option("--wales", type=click.IntRange(1, 500), default=4, show_default=True, help="Cells across the wales.")
@click.option("--courses", type=click.IntRange(1, 500), default=4, show_default=True, help="Cells along the wales.")
def export(file: Path, wales: int, courses: int, **which: Any) -> None:
    """Write the centre-lines of the yarns [mm] to FILE.vtu or FILE.csv.

    Example: knittest fabric export --variant 1 loops.vtu --wales 8
    """
    from knittest.export.meshes import export_centre_lines

    _, cell, _ = _relax(**which)
    export_centre_lines(file, cell, wales, courses)
    click.echo(str(file))


def _relaxation_rows(cell: "Cell") -> list[tuple[str, str]]:
    """Quality of the relaxation of one cell."""
    return [
        ("penetration / radius", f"{100 * cell.deepest:.2f} %; during relaxation at most {100 * cell.worst:.0f} %"),
        ("residual force", f"{cell.residual:.1e} N after {cell.iterations} iterations"),
        ("interlacing", "checked: layers and loops are in the right order"),
    ]


def _relaxed_rows(run: "Run") -> list[tuple[str, str]]:
    """Densities and area mass of the relaxed fabric of soft yarns, which follow from the yarn."""
    from knittest.config.fabric import yarn_area_mass

    fabric = run.fabric
    if not fabric.has_soft_yarns:
        return []
    return [
        ("wales, courses", f"{fabric.warp_density.value:.4g}, {fabric.weft_density.value:.4g} per 100 mm, relaxed"),
        ("area mass", f"{yarn_area_mass(fabric):.4g} g/m2 (in the file {fabric.area_mass.value:g} g/m2)"),
    ]


def _equilibrium_rows(run: "Run") -> list[tuple[str, str]]:
    """Initial equilibrium of the cell under the contact law of runs, where the fabric states one."""
    if not run.fabric.knitting.starts_relaxed:
        return []
    from knittest.base.history import equilibrium_numbers, equilibrium_rows
    from knittest.fabric.cell import CellSpec, Munden
    from knittest.solve.relaxed_cell import cell_curl, relaxed_contact_cell, with_loop_shortening

    click.echo("computing the initial equilibrium of the cell", err=True)
    found = relaxed_contact_cell(run)
    curls = cell_curl(with_loop_shortening(run))
    munden = Munden.of(CellSpec.of(run.fabric), found.draw_in)
    numbers = equilibrium_numbers(found.rest, munden.courses, munden.stitches, found.draw_in)
    return [
        ("initial equilibrium", f"after {found.steps} steps"),
        *equilibrium_rows(numbers),
        *(
            (
                f"curl along the {way}",
                f"{curl.curvature:+.3g} 1/mm (positive: face inside); held flat by a moment of {curl.moment:.3g} "
                f"N mm/mm; bending stiffness {curl.stiffness:.3g} N mm",
            )
            for way, curl in (("courses", curls["weft"]), ("wales", curls["warp"]))
        ),
    ]


def _relax(
    variant: str | None, fabric: Path | None, parameters: str | None, sets: tuple[str, ...]
) -> tuple["Run", "Cell", float | None]:
    """Run of the fabric, its cell and the seconds of the relaxation; ``None`` if the cell was in the cache."""
    from knittest.config.loading import resolve
    from knittest.fabric.relaxation import relaxed_cell
    from knittest.solve.relaxed_cell import relaxed_fabric

    run = resolve(variant=variant, fabric=fabric, parameters=parameters, sets=sets)
    started: list[float] = []

    def note() -> None:
        click.echo("relaxing geometry", err=True)
        started.append(time.perf_counter())

    if run.fabric.has_yarns and run.fabric.has_soft_yarns:
        note()
        run = run.model_copy(update={"fabric": relaxed_fabric(run.fabric)})
    cell = relaxed_cell(run.fabric, note)
    return run, cell, time.perf_counter() - started[0] if started else None
