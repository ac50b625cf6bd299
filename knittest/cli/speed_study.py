"""``knittest speed-study``."""

from pathlib import Path
from typing import Any

import click

from knittest.base.kinds import names


@click.command("speed-study")
@click.option("--variant", help="Shipped fabric.  [default: 1]")
@click.option("--fabric", type=click.Path(path_type=Path), help="A fabric file of your own.")
@click.option(
    "--test",
    "tests",
    multiple=True,
    type=click.Choice(names("studied")),
    help="Only this test; repeatable.  [default: all]",
)
@click.option(
    "--scale", type=click.Choice(["macro", "meso", "both"]), default="both", show_default=True, help="Shells or yarns."
)
@click.option("--direction", type=click.Choice(["warp", "weft"]), default="warp", show_default=True)
@click.option("--preset", type=click.Choice(["quick", "standard", "paper"]), default="quick", show_default=True)
@click.option("--out", type=click.Path(path_type=Path), default=Path("runs/speed-study"), show_default=True)
@click.option("--workers", type=click.IntRange(1), help="Processes.  [default: cores over threads]")
@click.option("--threads", type=click.IntRange(1), help="Threads of each.  [default: cores over workers]")
@click.option("--quiet", is_flag=True, help="No progress, no table.")
def speed_study(variant: str | None, fabric: Path | None, tests: tuple[str, ...], scale: str, **chosen: Any) -> int:
    """Run each test at its speed and at half of it, and write how much every result changes.

    The cantilever is at rest: there, what decides when it is at rest is halved. Finished runs in the folder are not
    repeated as long as code and data are the same. Tables: speed-study.csv and speed-study.md in OUT.

    Example: knittest speed-study --variant 2 --test friction --scale macro
    """
    from knittest.studies.speed_study.command import SCALES, StudyOptions, study_command

    if variant is None and fabric is None:
        variant = "1"
    scales = SCALES if scale == "both" else (scale,)
    return study_command(
        StudyOptions(variant=variant, fabric=fabric, tests=tests or names("studied"), scales=scales, **chosen)
    )
