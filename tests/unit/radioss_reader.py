"""Reads starter files of OpenRadioss by the columns of its reference guide, and writes time histories as it does."""

from collections import defaultdict

from deck_reader import cells

from knittest.config.loading import resolve_test_runs
from knittest.runs.deck.radioss_file import radioss_of
from knittest.runs.specimen import prepare

#: keywords whose first line is a card, not a title
UNTITLED = ("NODE", "SHELL", "BEAM", "SPRING", "FAIL")


def blocks_of(text):
    """Lines of each block without comments: by keyword and option, then by number (0 without one)."""
    lines = text.splitlines()
    assert lines[0] == "#RADIOSS STARTER" and lines[-1] == "/END"
    found, own = defaultdict(dict), []
    for line in lines[1:-1]:
        if line.startswith("/"):
            words = line[1:].split("/")
            number = int(words.pop()) if len(words) > 1 else 0
            name, own = "/".join(words), []
            assert number not in found[name], line
            found[name][number] = own
        elif not line.startswith("#"):
            assert len(line) <= 100, line
            own.append(line)
    return dict(found)


def numbers_of(lines):
    """Whole numbers, ten a card."""
    return [int(v) for line in lines for v in cells(line, 10)]


def table(lines, widths):
    """Rows of fields of ``widths`` columns."""
    return [cells(line, widths) for line in lines]


def functions_of(blocks):
    """Abscissae and ordinates by number."""
    return {n: tuple(zip(*table(lines[1:], [20, 20]), strict=True)) for n, lines in blocks["FUNCT"].items()}


def starter_of(kind, direction=None, sets=(), **chosen):
    """Run, prepared specimen, its mass before clamping, blocks of its starter file, and the engine file."""
    (run,) = resolve_test_runs(kind, direction, {"config": None, "sets": tuple(sets), **chosen})
    prepared = prepare(run)
    mass = prepared.model.mass.copy()
    starter, engine, _ = radioss_of("strip", run, prepared)
    return run, prepared, mass, blocks_of(starter.text()), engine


def history_text(time, groups, parts=3, subsets=1, version=4021):
    """A time history as hist1.F, hist2.F and wrtdes.F of the engine write it with /TFILE/3.

    ``groups``: type, codes of the variables, numbers of the members and values (n, n_members, n_variables).
    """
    name, title = "stripT01", 100 if version >= 3050 else {3041: 80}.get(version, 40)
    lines = [f"{name} FORMAT", _head((1, "I"), (72, "C")), f"{version:5d}{'strip':<72}", f"{name} FORMAT"]
    lines += [_head((80, "C")), f"{'Thu Aug 20 10:00:00 2026 RADIOSS linux64':<80}"]
    if version >= 3050:
        lines += [_head((1, "I")), f"{2:5d}", _head((1, "I")), f"{title:5d}", *_reals([1.0, 1.0, 1.0])]
    n_global = 15 if version >= 3050 else 12
    lines += [*_wholes([parts, 2, 3, subsets, len(groups), n_global]), *_wholes(range(1, n_global + 1))]
    for n in range(1, parts + 1):
        variables = 2 if n == 1 else 0
        lines += [_head((1, "I"), (40, "C"), (4, "I")), f"{n:10d}{'part':<{title}}{1:5d}{2:5d}{3:5d}{variables:5d}"]
        lines += _wholes([1, 2]) if variables else []
    for n in range(5):
        lines += [_head((1, "I"), (title, "C")), f"{n:10d}{'material or property':<{title}}"]
    for n in range(subsets):
        lines += [_head((5, "I"), (title, "C")), f"{n:10d}{0:10d}{0:10d}{parts:10d}{0:10d}{'GLOBAL MODEL':<{title}}"]
        lines += _wholes(range(1, parts + 1))
    for number, (kind, codes, members, _) in enumerate(groups, 1):
        lines += [_head((5, "I"), (title, "C"))]
        lines += [f"{number:10d}{kind:10d}{0:10d}{len(members):10d}{len(codes):10d}{'group':<{title}}"]
        for member in members:
            lines += [_head((1, "I"), (title, "C")), f"{member:10d}{'':<{title}}"]
        lines += _wholes(codes)
    for k, t in enumerate(time):
        lines += [*_reals([t]), *_reals([0.0] * n_global), *_reals([0.0] * 2)]
        for _, _, _, values in groups:
            lines += _reals(values[k].ravel())
    return "\n".join([*lines, ""])


def _head(*counts):
    return "ZZZZZEOR" + "".join(f"{n:5d}{kind}" if n < 1e5 else f"*****{kind}" for n, kind in counts)


def _wholes(values):
    values = list(values)
    rows = [values[k : k + 16] for k in range(0, len(values), 16)]
    return [_head((len(values), "I")), *("".join(f"{v:10d}" for v in row) for row in rows)]


def _reals(values):
    values = list(values)
    rows = [values[k : k + 5] for k in range(0, len(values), 5)]
    return [_head((len(values), "R")), *("".join(f" {_fortran(v)}" for v in row) for row in rows)]


def _fortran(value):
    """1PE15.8: the letter E is left out where the exponent has three digits."""
    if value != value:
        return "NaN".rjust(15)
    text = f"{value:15.8E}"
    mantissa, exponent = text.split("E")
    return text if len(exponent) == 3 else f"{mantissa}{exponent}".rjust(15)
