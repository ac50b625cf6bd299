"""Causes for which runs have no result that counts, in a few words."""

#: first words of what a run was refused or stopped by, and what they stand for
CAUSES = {
    "fabric.knitting.loop_shortening": "loops lock at that draw-in",
    "fabric.loop_length": "yarns lock",
    "fabric.reinforcing.section": "loops bend along the section",
    "energy error": "energy error",
    "kinetic": "kinetic energy",
    "damping": "damping of contacts",
    "contact damping": "damping of contacts",
    "overlap": "overlap that carries no force",
    "force-free": "overlap that carries no force",
    "contact forces": "mesh too coarse for the draw-in",
    "contacts on node": "contacts too stiff for the step",
}
#: words of a run that yarns ended where their images do
IMAGES = "the cell has no image"


def cause(reason: str) -> str:
    """First cause of a lost run in a few words."""
    return causes(reason)[0]


def causes(reason: str) -> list[str]:
    """All causes of a lost run in a few words: quality checks that it did not pass, or what went wrong."""
    if IMAGES in reason:
        return ["yarns beyond their images"]
    parts = reason.split("; ")
    found = dict.fromkeys(told for part in parts for start, told in CAUSES.items() if part.startswith(start))
    return list(found) or ["motion that blows up, or energy from nothing"]
