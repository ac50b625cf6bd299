"""The database in which Optuna keeps a study: SQLite in the folder of the calibration, or any that a URL names."""

import hashlib
import json
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from knittest.base.errors import InputError, ResourceError
from knittest.base.hiding import without_passwords
from knittest.base.reading import excerpt
from knittest.export.jsonfile import json_ready
from knittest.studies.calibrate.problem import Problem
from knittest.studies.trials.trial import code_digest

if TYPE_CHECKING:
    from optuna import Study
    from optuna.storages import RDBStorage
    from sqlalchemy import URL

#: file of the study without a URL
DATABASE = "optuna.db"
#: seconds for a server to answer, and its port where the URL names none
REACH_LIMIT = 10.0
PORTS = {"postgresql": 5432, "mysql": 3306, "mariadb": 3306, "mssql": 1433, "oracle": 1521}
DIGITS = 12
#: what may change while a study goes on
FREE = {"max_runs", "time_limit", "tolerance", "noise", "step", "storage"}


def check_installed() -> None:
    """Raise :class:`InputError` without the package."""
    if find_spec("optuna") is None:
        raise InputError("method = optuna: Optuna is not installed here: pip install 'knittest[calibrate]'")


def open_storage(url: str, where: str) -> "RDBStorage":
    """The database at ``url``, its tables made where there are none; ``where`` says who named it.

    Raises :class:`InputError` for a text that is no URL, for an unknown kind of database, and for a missing driver;
    :class:`ResourceError` when the database cannot be reached or read.
    """
    import optuna
    from sqlalchemy import make_url
    from sqlalchemy.exc import ArgumentError, NoSuchModuleError

    optuna.logging.set_verbosity(optuna.logging.CRITICAL)  # what it has to say is in the exceptions
    try:
        parts = make_url(url)
        shown = f"{where}: {_shown(parts)}"
        parts.get_dialect().import_dbapi()
        _reach(parts, shown)
        with readable(shown):
            return optuna.storages.RDBStorage(url)
    except ImportError as error:
        raise InputError(
            f"{shown}: the driver of this database is not installed: {without_passwords(str(error))}"
        ) from None
    except (ArgumentError, NoSuchModuleError, ValueError) as error:
        why = without_passwords(excerpt(str(error)))
        raise InputError(f"{where}: no URL of a database that is known: {why}; expected for example "
                         "sqlite:///study.db or postgresql://user@host/name") from None  # fmt: skip


@contextmanager
def readable(shown: str) -> Iterator[None]:
    """Turn what goes wrong with the database ``shown`` into a :class:`ResourceError`."""
    from optuna.exceptions import StorageInternalError
    from sqlalchemy.exc import SQLAlchemyError

    try:
        yield
    except (SQLAlchemyError, StorageInternalError) as error:
        cause = error.__cause__ if isinstance(error, StorageInternalError) and error.__cause__ else error
        why = without_passwords(excerpt(str(getattr(cause, "orig", None) or cause)))
        raise ResourceError(f"{shown}: the database does not answer: {why}; what is finished is kept") from None
    except RuntimeError as error:  # tables of another version of Optuna
        raise ResourceError(f"{shown}: {without_passwords(excerpt(str(error)))}") from None


def open_study(problem: Problem, storage: "RDBStorage", folder: Path) -> "Study":
    """The study of ``problem`` in ``folder``, new or gone on with; another problem, code or folder has another one.

    Raises :class:`ResourceError`.
    """
    import optuna

    with readable(shown_url(storage)):
        return optuna.create_study(
            storage=storage, study_name=_name(problem, folder), direction="minimize", load_if_exists=True
        )


def shown_url(storage: "RDBStorage") -> str:
    """URL of ``storage`` without a password."""
    return _shown(storage.engine.url)


def _shown(url: "URL") -> str:
    return without_passwords(url.render_as_string(hide_password=True))


def without_password_of_storage(text: str, storage: str | None) -> str:
    """The calibration file ``text`` whose database is ``storage``, however it is written there, without passwords."""
    import yaml

    if storage is not None and without_passwords(storage) != storage:
        root = yaml.compose(text, yaml.SafeLoader)
        assert isinstance(root, yaml.MappingNode)  # it was read before
        (value,) = (node for key, node in root.value if key.value == "storage")
        begin, end = value.start_mark.index, value.end_mark.index
        lines = "\n" * text.count("\n", begin, end)  # so that what stands behind keeps its line
        text = f"{text[:begin]}{json.dumps(without_passwords(storage))}{lines}{text[end:]}"
    return without_passwords(text)


def _name(problem: Problem, folder: Path) -> str:
    calibration = problem.calibration.model_dump(mode="json", exclude=FREE)
    runs = [case.run().model_dump(mode="json") for case in problem.cases]
    content = [calibration, runs, code_digest(), socket.gethostname(), str(folder.resolve())]
    text = json.dumps(json_ready(content), sort_keys=True)
    return f"{problem.name}-{hashlib.sha256(text.encode()).hexdigest()[:DIGITS]}"


def _reach(url: "URL", shown: str) -> None:
    """Knock at the server: some drivers wait for minutes for one that is not there."""
    port = url.port or PORTS.get(url.get_backend_name())
    if not url.host or port is None:
        return
    try:
        socket.create_connection((url.host, port), REACH_LIMIT).close()
    except OSError as error:
        raise ResourceError(f"{shown}: no answer from {url.host}:{port}: {error}") from None
