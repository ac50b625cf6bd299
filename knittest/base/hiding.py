"""Keeps out of files and messages: passwords in URLs, and, where a user wants it so, this machine's name."""

import os
import re
import socket

HIDDEN = "***"
HOST_VARIABLE = "KNITTEST_HOST"
# as SQLAlchemy reads them: a user without colon or slash, a password up to the @
_PASSWORD = re.compile(r"(://[^:/\s@]*:)[^@\s]*@")
_IN_QUERY = re.compile(r"([?&][^=&\s]*(?:pass|pwd|secret|token|key)[^=&\s]*=)[^&\s'\"]*", re.IGNORECASE)


def without_passwords(text: str) -> str:
    """``text`` with :data:`HIDDEN` for the password of every URL in it, also of one in its query."""
    return _IN_QUERY.sub(rf"\g<1>{HIDDEN}", _PASSWORD.sub(rf"\g<1>{HIDDEN}@", text))


def host_name() -> str:
    """Name of this machine in files: its own, or what ``KNITTEST_HOST`` says in its place, which may be nothing."""
    return os.environ.get(HOST_VARIABLE, socket.gethostname())
