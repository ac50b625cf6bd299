"""``knittest regress``."""

from pathlib import Path
from typing import Any

import click


@click.command()
@click.option("--table", type=click.Choice(["3", "4"]), help="Only this table of the paper.  [default: both]")
@click.option("--scale", type=click.Choice(["macro", "meso", "both"]), default="both", show_default=True)
@click.option(
    "--level",
    type=click.Choice(["quick", "full"]),
    default="quick",
    show_default=True,
    help="quick: for every push; full: all rows, most at the size of the paper.",
)
@click.option(
    "--sd",
    "limit_sd",
    type=click.FloatRange(0.0, 100.0, min_open=True),
    default=1.0,
    show_default=True,
    help="Standard deviations of the experiment that predicted and tuned rows may deviate.",
)
@click.option(
    "--baseline", type=click.Path(path_type=Path), help="The code's own numbers.  [default: the shipped ones]"
)
@click.option("--update-baseline", "update", is_flag=True, help="Write the numbers of these runs to the baseline.")
@click.option(
    "--accept-wider",
    multiple=True,
    metavar="RUN",
    help="With --update-baseline: store this run though its limits grow by more than 30 %, or a number is gone.",
)
@click.option("--out", type=click.Path(path_type=Path), default=Path("runs/regress"), show_default=True)
@click.option("--junit", type=click.Path(path_type=Path), metavar="FILE", help="Write JUnit XML for a CI server.")
@click.option("--workers", type=click.IntRange(1), help="Processes.  [default: cores over threads; with --table 4: 2]")
@click.option(
    "--threads", type=click.IntRange(1), help="Threads of each.  [default: cores over workers; with --table 4: 1]"
)
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout and nothing else there.")
@click.option("--quiet", is_flag=True, help="No progress, no table.")
def regress(table: str | None, as_json: bool, **chosen: Any) -> int:
    """Judge the code by Table 3 of the paper, row by row, and by its own stored numbers; exit code 5 if it fails.

    Finished runs in the folder are not repeated as long as code and data are the same.

    Example: knittest regress --level quick --junit regress.xml
    """
    from knittest.studies.regress.command import RegressOptions, regress_command

    number: Any = None if table is None else int(table)
    return regress_command(RegressOptions(table=number, json=as_json, **chosen))
