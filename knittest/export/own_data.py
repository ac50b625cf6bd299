"""Data files of a fabric that is written to a folder, kept beside it so that both can be moved."""

import shutil
from pathlib import Path

from knittest.base.atomic import resource_error
from knittest.base.resources import data_dir

#: subfolder for them
OWN = "data"


def kept_beside(text: str, folder: Path, name: str) -> str:
    """``text`` for a file or folder of the shipped data, else a copy of it in ``folder`` under :data:`OWN`.

    Of a folder the tables are copied. Raises :class:`ResourceError`.
    """
    if not Path(text).is_absolute() and (data_dir() / text).exists():
        return text
    copy = folder / OWN / name
    try:
        copy.parent.mkdir(exist_ok=True)
        if Path(text).is_dir():
            copy.mkdir(exist_ok=True)
            for table in sorted(Path(text).glob("*.csv")):
                shutil.copyfile(table, copy / table.name)
        else:
            shutil.copyfile(text, copy)
    except OSError as error:
        raise resource_error(copy, error) from error
    return f"{OWN}/{name}"
