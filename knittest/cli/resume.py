"""``knittest resume``."""

from pathlib import Path

import click

from knittest.cli.options import printing_asked, reports


@click.command()
@click.argument("run", type=click.Path(path_type=Path))
@click.option("--force", is_flag=True, help="Go on although config, version or processor changed.")
@reports
def resume(
    run: Path,
    force: bool,
    threads: int | None,
    as_json: bool,
    quiet: bool,
    details: bool,
    no_frames: bool,
    no_pictures: bool,
    against: tuple[Path, ...],
    open_page: bool,
    formats: str | None,
    dpi: int | None,
) -> int:
    """Go on with a run that was interrupted, killed or ran out of disk, to the bits it would have had.

    RUN is the run folder, or the folder of both directions.

    Example: knittest resume runs/tensile-...
    """
    from knittest.runs.options import RunOptions
    from knittest.studies.command import resume_command

    printing = printing_asked(formats, dpi, no_pictures, open_page)
    options = RunOptions(
        None, threads, as_json, quiet, not no_frames, not no_pictures, against, printing, open_page, details
    )
    return resume_command(run, options, force)
