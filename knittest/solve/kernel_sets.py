"""Names of the kernels that runs need: a scale, and what they are compiled for beside, as meso-tools-threads."""

from knittest.base.kinds import kinds
from knittest.config.run import Run

#: self-contact of shells, rigid tools, crossings that resist spin, elliptic sections, a periodic cell, several threads
CONTACT, TOOLS, SPIN, OVAL, PERIODIC, THREADS = "contact", "tools", "spin", "oval", "periodic", "threads"
#: what ``knittest warmup`` compiles, by scale; the first run whose crossings resist spin or whose sections are elliptic
#: compiles what it needs
ALL = {
    "meso": ("meso", "meso-tools", "meso-periodic", "meso-threads", "meso-tools-threads"),
    "macro": ("macro", "macro-tools", "macro-contact-tools", "macro-threads", "macro-tools-threads"),
}


def kernels_of(run: Run, threads: int = 1) -> tuple[str, ...]:
    """Kernels that ``run`` needs on ``threads``, those of a cell that its fabric settles in first."""
    needed = _needed(run)
    names = [_name(run, needed)]
    if run.model.scale == "meso" and run.fabric.knitting.settled and PERIODIC not in needed:
        names.insert(0, _name(run, [n for n in needed if n != TOOLS] + [PERIODIC]))
    if threads > 1:
        names.append(_name(run, [*needed, THREADS]))
    return tuple(names)


def _needed(run: Run) -> list[str]:
    kind, meso, contact = kinds()[run.rig.kind], run.model.scale == "meso", run.fabric.contact
    wanted = {
        CONTACT: not meso and run.model.macro.self_contact,
        TOOLS: kind.tools,
        SPIN: meso and contact is not None and contact.patch is not None,
        OVAL: meso and run.fabric.reinforcing.section is not None,
        PERIODIC: kind.periodic,
    }
    return [name for name, so in wanted.items() if so]


def _name(run: Run, needed: list[str]) -> str:
    return "-".join([run.model.scale, *needed])


def is_for(kernels: str, what: str) -> bool:
    """Tell whether ``kernels`` are compiled for one of :data:`CONTACT` to :data:`THREADS`."""
    return what in kernels.split("-")
