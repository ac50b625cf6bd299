"""STL files of the tools of a forming run."""

from pathlib import Path

from knittest.base.atomic import replacing, resource_error
from knittest.tooling.toolset import ToolSet


def write_tools(tools: ToolSet, folder: Path) -> list[Path]:
    """Write stamp.stl, die.stl and, if there is one, holder.stl (binary, mm) to ``folder``, each where it starts.

    Made if it is not there. Raises :class:`ResourceError`.
    """
    import meshio

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise resource_error(folder, error) from error
    paths = []
    for name, tool in tools.by_name.items():
        mesh = meshio.Mesh(tool.solid.points, [("triangle", tool.solid.triangles)])
        paths.append(folder / f"{name}.stl")
        with replacing(paths[-1]) as temporary:
            meshio.write(temporary, mesh, file_format="stl", binary=True)
    return paths
