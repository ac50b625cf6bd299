"""Mesh of a model as Abaqus reads it: nodes, elements and their parts as sets; no materials, no motion."""

from pathlib import Path

import numpy as np

from knittest.base.atomic import replacing
from knittest.base.history import Array, Mesh

#: kind of cells of the mesh, and the type of Abaqus they are; meshio knows no more than how many corners they have
CELLS = {"beams": ("line", "B31"), "shells": ("quad", "S4R")}


def write_abaqus(path: Path, mesh: Mesh, position: Array) -> None:
    """Write ``mesh`` with nodes at ``position`` [mm], (n, 3), and a set of elements for each of its parts.

    Raises :class:`ResourceError`.
    """
    import meshio
    from meshio.abaqus._abaqus import meshio_to_abaqus_type

    shape, wanted = CELLS[mesh.kind]
    sets = {name: [np.flatnonzero(mesh.part == part)] for part, name in enumerate(mesh.part_names)}
    content = meshio.Mesh(position, [(shape, mesh.cells)], cell_sets=sets)
    with replacing(path) as temporary:
        meshio.write(temporary, content, file_format="abaqus")
        written = temporary.read_text(encoding="utf-8")
        typed = written.replace(f"TYPE={meshio_to_abaqus_type[shape]}\n", f"TYPE={wanted}\n")
        temporary.write_text(typed, encoding="utf-8")
