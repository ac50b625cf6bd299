"""Writes the reports of one run and of several runs."""

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from knittest import __version__
from knittest.base.errors import InputError
from knittest.base.figure import Printing, use_printing
from knittest.base.files import write_atomic
from knittest.base.layout import shorten_path
from knittest.config.sources import parameter_set_text
from knittest.export.identity import data_files, sha256_files, sha256_text
from knittest.report_page.blocks import Block, Cell, Code, Page, Section, Table, Text, without_forbidden, wrap_points
from knittest.report_page.comparison import (
    differences,
    group_by_test,
    overview,
    print_pictures,
    results_side_by_side,
    shared_pictures,
)
from knittest.report_page.curves import curve_section
from knittest.report_page.folders import command_folder, find_runs
from knittest.report_page.guide import explain
from knittest.report_page.loaded_run import LoadedRun, load_run
from knittest.report_page.parameters import format_value, parameters
from knittest.report_page.pictures import data_uri, pictures
from knittest.report_page.quality_checks import quality_section
from knittest.report_page.results import ending_notices, results
from knittest.report_page.studies import studies


def repeat_section(run: LoadedRun) -> Section:
    """Section with the command, the resolved config, the provenance, and files that changed since the run."""
    blocks: list[Block] = []
    if run.config_text and run.run is not None:
        threads = f" --threads {run.manifest.threads}" if run.manifest.threads else ""
        version = f" of knittest {run.manifest.version}" if run.manifest.version else ""
        caption = f"Command{version}, with the config.yaml below"
        blocks.append(Code(f"knittest {run.rig} --config config.yaml{threads}", caption))
    if run.config_text:
        uri = data_uri(run.config_text.encode("utf-8"), "text/yaml;charset=utf-8")
        blocks.append(Code(run.config_text, "The resolved config", ("config.yaml", uri)))
    manifest = run.manifest
    facts: dict[str, object] = {
        "run folder": run.path,
        "status": f"{manifest.status}, exit code {manifest.exit_code}" if manifest.status else None,
        "started": manifest.started,
        "ended": manifest.ended,
        "seed": manifest.seed,
        "config.yaml, SHA-256": manifest.config_sha256,
    }
    blocks.append(_facts_table("Provenance", facts | manifest.facts()))
    known = {manifest.config_sha256, *(str(note.get("config_sha256")) for note in manifest.resumed)}
    if manifest.config_sha256 and run.config_text and sha256_text(run.config_text) not in known:
        changed = "config.yaml was changed after the run: it does not match the hash in manifest.json."
        blocks.append(Text(changed, "warn"))
    now: dict[str, str] = {}
    with suppress(InputError):
        now = sha256_files(data_files(run.run)) if run.run else {}
    for name, digest in manifest.data_sha256.items():
        if now.get(name, digest) != digest:
            changed = f"{name} was changed after the run: the references may differ from those of the run."
            blocks.append(Text(changed, "warn"))
    for note in run.manifest.resumed:
        forced = note.get("forced")
        by_force = f", with --force although {'; '.join(map(str, forced))}" if isinstance(forced, list) else ""
        text = f"Resumed on {note.get('time')} at {note.get('at_ms')} ms{by_force}."
        blocks.append(Text(text, "warn" if forced else ""))
    return Section(f"run-{run.number}-repeat", "How to repeat the run", blocks)


def _facts_table(caption: str, facts: Mapping[str, object]) -> Table:
    rows = [(Cell(name), Cell(str(value))) for name, value in facts.items() if value not in (None, "")]
    return Table(caption, (), rows)


#: name of the report in a run folder
FILE = "report.html"
#: name of the interactive view in a run folder
VIEW = "view.html"
#: mark of every page; only files with it are overwritten
GENERATOR = "knittest report"


def write_report(folder: Path) -> Path:
    """Write the report of the run folder ``folder``; raises :class:`InputError`, :class:`ResourceError`."""
    return write_page(folder / FILE, run_page(load_run(folder), folder))


def refresh_report(folder: Path) -> None:
    """Write the report of the run folder ``folder`` again if it has one, for instance to link a new view."""
    if _is_page(folder / FILE):
        write_if_possible(folder, write_report)


def write_reports(
    paths: list[Path], out: Path | None, printing: Printing | None = None, *, explained: bool = False
) -> tuple[Path, int]:
    """Write one page on all runs in ``paths``; returns its path and the number of runs.

    By default the page of one path lies in its folder, the page of several paths in the working folder. With
    ``printing``, curves and fields are written next to the page in its formats,
    and ``explained`` adds explanations for newcomers. Raises :class:`InputError` for a path
    without runs and an ``out`` that is not a page, :class:`ResourceError` when the page cannot be written.
    """
    found, notes = find_runs(paths)
    runs: list[LoadedRun] = []
    for one in found:
        try:
            runs.append(load_run(one.path, len(runs) + 1))
        except InputError as error:
            if one.named:
                raise
            notes.append(str(error))
    if not runs:
        raise InputError("; ".join(notes))
    target = target_file(paths, out)
    alone = len(runs) == 1 and not notes
    page = run_page(runs[0], target.parent) if alone else _comparison_page(runs, notes)
    write_page(target, explain(page, runs[0].summary.variant, shorten_path(paths[0])) if explained else page)
    if printing is not None:
        with use_printing(printing):
            print_pictures(runs, target)
    return target, len(runs)


def run_page(run: LoadedRun, place: Path) -> Page:
    """Page of one run, to be written into ``place``."""
    first, *rest = run_sections(run)
    fabric = str(run.setting("fabric", "title") or "")
    blocks = list(first.blocks)
    if place.resolve() == Path(run.path).resolve() and (place / VIEW).is_file():
        blocks.append(Table("Rotate and play", (), [(Cell("interactive view"), Cell(VIEW, href=VIEW))]))
    return Page(run.title, fabric, [Section("summary", "Run", blocks, 2), *(replace(s, level=2) for s in rest)])


def _comparison_page(runs: Sequence[LoadedRun], notes: Sequence[str]) -> Page:
    """Page of several runs: overview and comparison, then each run."""
    sections = [overview(runs, notes), results_side_by_side(runs), differences(runs)]
    above = {run.number: shared_pictures(group) for _, group in group_by_test(runs) for run in group}
    for run in runs:
        sections += run_sections(run, above[run.number])
    return Page(f"Comparison of {len(runs)} runs", "", sections)


def run_sections(run: LoadedRun, above: frozenset[str] = frozenset()) -> list[Section]:
    """All sections on one run, without the pictures shown ``above``; checks, studies, parameters, provenance folded."""
    shown_curve, complete = curve_section(run)
    head = Section(f"run-{run.number}", f"Run {run.number}: {run.title}", ending_notices(run), level=2)
    described = parameters(run)
    described = replace(described, blocks=[_facts(run), *described.blocks])
    rest = [quality_section(run), *studies(run), described, repeat_section(run)]
    return [head, results(run), shown_curve, pictures(run, complete, above), *(replace(s, folded=True) for s in rest)]


def render(page: Page) -> str:
    """HTML of ``page``; all texts are escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    loader = PackageLoader("knittest.report_page")
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    environment.filters["parts"] = wrap_points
    html = environment.get_template("page.html").render(page=page, generator=GENERATOR, version=__version__)
    return without_forbidden(html)


def _facts(run: LoadedRun) -> Table:
    variability = run.setting("variability", "specimens")
    facts = {
        "fabric": run.setting("fabric", "title") or run.setting("fabric", "name") or run.summary.variant,
        "test": run.rig,
        "scale": run.setting("model", "scale") or run.summary.scale,
        "direction": run.setting("rig", "direction") or run.summary.direction,
        "preset": run.setting("model", "preset"),
        "parameter set": parameter_set_text(str(run.setting("parameters") or "")),
        "specimens": variability if variability is None else format_value(variability),
        "status": run.manifest.status,
        "run folder": run.name,
    }
    return _facts_table("Run", facts)


def target_file(paths: list[Path], out: Path | None) -> Path:
    """Path of the page on ``paths``; raises :class:`InputError` for an existing file that is not a page."""
    target = out if out is not None else paths[0] / FILE if len(paths) == 1 else Path(f"knittest-{FILE}")
    if target.is_dir():
        raise InputError(f"--out {target}: is a folder, expected a file such as {target / FILE}")
    if target.exists() and not _is_page(target):
        raise InputError(f"{target}: exists and is not a page of knittest report; choose another file with --out")
    if not target.parent.is_dir():
        raise InputError(f"--out {target}: its folder {target.parent} does not exist")
    return target


def _is_page(path: Path) -> bool:
    try:
        with path.open("rb") as stream:
            return json.dumps(GENERATOR).encode() in stream.read(1000)
    except OSError:
        return False


def page_of(run: Path) -> Path | None:
    """Page on the run folder ``run``: that of all runs of its command, else its own; None without a page."""
    pages = (command_folder(run) / FILE, run / FILE)
    return next((page for page in pages if page.is_file()), None)


def write_page(path: Path, page: Page) -> Path:
    """Write ``page`` to the file ``path``; raises :class:`ResourceError`."""
    write_atomic(path, render(page))
    return path


def write_if_possible(folder: Path, write: Callable[[Path], object]) -> None:
    """``write`` the page of ``folder``; a problem is only printed on standard error, since the run is complete."""
    try:
        write(folder)
    except Exception as error:
        reason = error or type(error).__name__
        print(f"knittest: {folder}: complete, but {FILE} could not be written: {reason}", file=sys.stderr)
