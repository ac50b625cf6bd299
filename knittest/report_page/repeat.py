"""Recipe to repeat a run: commands, config, versions, hashes, seed."""

from knittest.base.errors import InputError
from knittest.config.run import Run
from knittest.export.identity import data_files
from knittest.export.provenance import sha256_files, sha256_text
from knittest.report_page.blocks import Block, Cell, Code, Section, Table, Text
from knittest.report_page.loading import LoadedRun
from knittest.report_page.pictures import data_uri


def repeat(run: LoadedRun) -> Section:
    """Commands and the resolved config, provenance, and whether the files still are what the run read."""
    blocks: list[Block] = []
    if run.config_text and run.run is not None:
        threads = f" --threads {run.manifest.threads}" if run.manifest.threads else ""
        version = f" of knittest {run.manifest.version}" if run.manifest.version else ""
        caption = f"Command{version}; config.yaml is the one below"
        blocks.append(Code(f"knittest {run.rig} --config config.yaml{threads}", caption))
    if run.config_text:
        uri = data_uri(run.config_text.encode("utf-8"), "text/yaml;charset=utf-8")
        blocks.append(Code(run.config_text, "The resolved config", ("config.yaml", uri)))
    rows = _provenance(run)
    if rows:
        blocks.append(Table("Provenance", (), rows))
    blocks += [Text(text, "warn") for text in _changed(run)]
    for note in run.manifest.resumed:
        forced = note.get("forced")
        by_force = f"; by force, although {'; '.join(map(str, forced))}" if isinstance(forced, list) else ""
        text = f"Resumed on {note.get('time')} at {note.get('at_ms')} ms{by_force}."
        blocks.append(Text(text, "warn" if forced else ""))
    return Section(f"run-{run.number}-repeat", "How to repeat it", blocks or [Text("Nothing is known of it.", "warn")])


def _provenance(run: LoadedRun) -> list[tuple[Cell, ...]]:
    manifest = run.manifest
    facts = {
        "run folder": run.path,
        "status": f"{manifest.status}, exit code {manifest.exit_code}" if manifest.status else None,
        "started": manifest.started,
        "ended": manifest.ended,
        "knittest": manifest.version,
        "commit": manifest.git_commit,
        "seed": manifest.seed,
        "processor": manifest.cpu,
        "threads": manifest.threads,
        "config.yaml, SHA-256": manifest.config_sha256,
        **{f"{name}, SHA-256": digest for name, digest in manifest.data_sha256.items()},
        **manifest.libraries,
    }
    return [(Cell(name), Cell(str(value))) for name, value in facts.items() if value not in (None, "")]


def _changed(run: LoadedRun) -> list[str]:
    """Inputs that are no longer as the run read them."""
    found, manifest = [], run.manifest
    known = {manifest.config_sha256, *(str(note.get("config_sha256")) for note in manifest.resumed)}
    if manifest.config_sha256 and run.config_text and sha256_text(run.config_text) not in known:
        found.append("config.yaml was changed after the run: it does not match the hash in manifest.json.")
    now = _data_hashes(run.run) if run.run else {}
    for name, digest in manifest.data_sha256.items():
        if name in now and now[name] != digest:
            found.append(f"{name} was changed after the run: curves to compare with may not be those the run used.")
    return found


def _data_hashes(run: Run) -> dict[str, str]:
    """Hashes of the files that the run would read now."""
    try:
        return sha256_files(data_files(run))
    except InputError:
        return {}
