"""A platform without POSIX: modules and functions that Windows lacks are hidden; its terminals, its default encoding.

This replaces no Windows: its file locks, its processes and its paths are not tried here.
"""

import os
import subprocess
import sys
import textwrap
from pathlib import Path

from report_sample import write_run

from knittest.base.files import PACKAGE

#: hides from knittest, after its libraries were loaded, what the standard library lacks on Windows
HIDE = """
    import importlib, os, pkgutil, signal, sys, warnings
    import filelock, jinja2, matplotlib.figure, numba, numpy, pandas, PIL.Image, platformdirs, rich.console, scipy
    import matplotlib.backends.backend_agg, matplotlib.backends.backend_svg, asyncio, multiprocessing.connection
    for name in ("fcntl", "resource", "pwd", "grp", "termios", "tty", "pty", "syslog", "readline"):
        sys.modules[name] = None
    for name in (
        "fork", "forkpty", "geteuid", "getuid", "getegid", "getgid", "getpgid", "getpgrp", "killpg", "setsid", "pread",
        "pwrite", "sched_getaffinity", "sched_setaffinity", "statvfs", "uname", "nice", "mkfifo", "chown", "fchown",
        "fchmod", "O_NOFOLLOW", "O_NONBLOCK", "O_DIRECTORY", "O_CLOEXEC", "getloadavg",
    ):
        if hasattr(os, name):
            delattr(os, name)
    for name in ("SIGUSR1", "SIGUSR2", "SIGHUP", "SIGSTOP", "SIGCONT", "SIGALRM", "SIGQUIT", "SIGPIPE", "alarm"):
        delattr(signal, name)
    warnings.filterwarnings("error", category=EncodingWarning, module="knittest")
"""


def without_posix(script: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run ``script`` in ``folder``, in a process without what Windows lacks, on a terminal of Western Europe."""
    text = textwrap.dedent(HIDE) + textwrap.dedent(script)
    environment = os.environ | {"PYTHONPATH": str(PACKAGE.parent), "PYTHONIOENCODING": "cp1252"}
    command = [sys.executable, "-X", "warn_default_encoding", "-c", text]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, encoding="cp1252")


def test_every_module_is_loaded_without_posix(tmp_path):
    script = """
        import knittest
        names = [one.name for one in pkgutil.walk_packages(knittest.__path__, "knittest.")]
        for name in names:
            if name != "knittest.__main__":
                importlib.import_module(name)
        print(len(names) > 300)
    """
    done = without_posix(script, tmp_path)
    assert (done.returncode, done.stdout) == (0, "True\n"), done.stderr


def test_a_run_without_posix(tmp_path):
    """Locks, caches, kernels, pictures, the table on a terminal of Western Europe; the same folder twice is refused."""
    script = """
        from knittest.cli.main import run
        words = "tensile --variant 1 --scale macro --preset quick --direction warp --threads 1 --out run".split()
        print([run(words), run(words), run(["runs", "."]), run(["doctor"])], flush=True)
        os._exit(0)  # libraries tidy up by functions that are hidden
    """
    done = without_posix(script, tmp_path)
    assert done.stdout.splitlines()[-1:] == ["[0, 2, 0, 0]"], done.stderr + done.stdout
    assert "±" in done.stdout
    assert "not empty" in done.stderr
    names = {path.name for path in (tmp_path / "run").rglob("*")}
    assert {"curve.csv", "report.html", "deformed.png"} <= names and "run.lock" not in names
    assert not any(set(name) & set('<>:"|?*') for name in names)


def test_a_letter_that_the_terminal_lacks_does_not_end_the_command(tmp_path):
    write_run(tmp_path / "\u0142\u00f3d\u017a/run")
    environment = os.environ | {"PYTHONPATH": str(PACKAGE.parent), "PYTHONIOENCODING": "cp1252"}
    command = [sys.executable, "-m", "knittest", "runs", "."]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, encoding="cp1252")
    assert done.returncode == 0 and "\\u0142\u00f3d\\u017a" in done.stdout, done.stderr
