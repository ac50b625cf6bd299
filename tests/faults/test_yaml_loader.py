"""Reliability cases 2 to 10 on the reader itself: each refused with its line, or read by YAML 1.2."""

import contextlib
import os
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from knittest.base.errors import InputError
from knittest.config.yaml_loader import MAX_BYTES, MAX_DEPTH, MAX_NODES, load_yaml, parse_document


def refused(text: str) -> str:
    with pytest.raises(InputError) as error:
        parse_document(text, "f.yaml")
    return str(error.value)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 1e-3), ("1E3", 1000.0), (".5", 0.5), ("5.", 5.0), ("012", 12), ("0o17", 15), ("0x1F", 31), ("-7", -7),
        ("12:30:45", "12:30:45"), ("no", "no"), ("on", "on"), ("Yes", "Yes"), ("1_000", "1_000"), ("0b11", "0b11"),
        ("2019-11-01", "2019-11-01"), ("3,5", "3,5"), ("true", True), ("~", None), ("", None), ("'1'", "1"),
        ('"\\u00e9"', "é"),
    ],
)  # fmt: skip
def test_scalars_follow_yaml_1_2(text, value):
    found = parse_document(f"a: {text}", "f.yaml").data["a"]
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize(
    ("text", "line", "phrase"),
    [
        ("a: 1\nb:\n  c: 1\n  c: 2", 4, "b.c: duplicate key, first given in line 3"),
        ("a: 1\n'a': 2", 2, "duplicate key"),
        ("a: 1\nb: .nan", 2, "finite"),
        ("a: [1,\n  -.INF]", 2, "finite"),
        ("a: 1e999", 1, "1.8e308"),
        ("a: 123456789012345678901234567890", 1, "18 digits"),
        (f"a: {'9' * 6000}", 1, "18 digits"),
        ("a: &x 1\nb: *x", 1, "anchors and aliases are not allowed"),
        ("b: *x", 1, "anchors and aliases are not allowed"),
        (
            "a: &a [x, x]\n" + "".join(f"b{k}: &b [*a, *a]\n" for k in range(20)),
            1,
            "anchors and aliases are not allowed",
        ),
        ("a: 1\n<<: {b: 2}", 2, "merge keys"),
        ("a: !!python/object/apply:os.system [ls]", 1, "tags are not allowed"),
        ("a: !!float 1", 1, "tags are not allowed"),
        ("a: !own 1", 1, "tags are not allowed"),
        ("a: 1\n---\nb: 2", 2, "one YAML document"),
        ("%YAML 1.1\n---\na: no", 1, "YAML 1.2"),
        ("", 1, "empty"),
        ("# only a comment\n", 1, "empty"),
        ("- 1\n- 2", 1, "found a list"),
        ("just text", 1, "found text 'just text'"),
        ("a: [1, 2", 1, "not valid YAML"),
        ("a: 1\n\tb: 2", 2, "not valid YAML"),
        ("a: 1\nb: \x07", 2, "U+0007"),
        ('a: "\\ud800"', 1, "surrogate"),
        ("1: 2", 1, "expected a field name"),
        ("? [a]\n: 1", 1, "expected a field name"),
    ],
)
def test_refused_with_line(text, line, phrase):
    message = refused(text)
    assert message.startswith(f"f.yaml:{line}: ")
    assert phrase in message


@pytest.mark.parametrize("text", ['a: "\\U99999999"', f"%YAML 1.{'9' * 5000}\n---\na: 1"])
def test_what_pyyaml_itself_trips_over_is_refused(text):
    assert "not valid YAML" in refused(text)


def test_sizes_are_bounded_without_recursion():
    for opening in ("[", "{a: ", "- "):
        assert f"deeper than {MAX_DEPTH}" in refused("a:\n " + opening * 5000)
    text = "a: " + "[" * (MAX_DEPTH - 2) + "]" * (MAX_DEPTH - 2)
    assert parse_document(text, "f.yaml").data["a"] is not None
    assert f"more than {MAX_NODES}" in refused("a: [" + "1," * (MAX_NODES + 1) + "]")


def test_lines_are_remembered_per_key_path():
    document = parse_document("a:\n  b: 1\n  c:\n    - x\n    - {d: 2}\n", "f.yaml")
    assert document.place_of(("a", "b")) == "f.yaml:2"
    assert document.place_of(("a", "c", 1, "d")) == "f.yaml:5"
    assert document.place_of(("a", "missing", "deeper")) == "f.yaml:1"


@pytest.mark.parametrize(
    ("raw", "phrase"),
    [("a: é".encode("latin-1"), "not UTF-8"), ("a: 1".encode("utf-16"), "not UTF-8"),
     (b"a: 1\n# " + b"x" * MAX_BYTES, "larger than")],
)  # fmt: skip
def test_files_that_are_no_config(tmp_path, raw, phrase):
    path = tmp_path / "f.yaml"
    path.write_bytes(raw)
    with pytest.raises(InputError, match=phrase):
        load_yaml(path)
    path.write_bytes(b"\xef\xbb\xbfa: 1\n")  # a byte order mark
    assert load_yaml(path).data == {"a": 1}


def test_no_file_folder_device_and_pipe_are_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "none.yaml", tmp_path, tmp_path / "pipe", "/dev/zero", "bad\0name"):
        start = time.perf_counter()
        with pytest.raises(InputError):
            load_yaml(path)
        assert time.perf_counter() - start < 1.0


YAML_TEXT = st.text(st.sampled_from("ab01 \n:-[]{},&*!<>?'\"#%|.\\~\tU\x00é"), max_size=80)


def read_or_refused(read):
    try:
        assert isinstance(read().data, dict)
    except InputError as error:
        assert "f.yaml" in str(error)


@settings(max_examples=400, deadline=2000)
@given(YAML_TEXT | st.text(max_size=60))
def test_any_text_is_read_or_refused(text):
    read_or_refused(lambda: parse_document(text, "f.yaml"))


@settings(max_examples=100, deadline=2000)
@given(st.binary(max_size=80))
def test_any_bytes_are_read_or_refused(tmp_path_factory, raw):
    path = tmp_path_factory.mktemp("fuzz") / "f.yaml"
    path.write_bytes(raw)
    read_or_refused(lambda: load_yaml(path))


@pytest.mark.parametrize(
    "text",
    [
        "[" * 900_000, "{" * 900_000, "a: |\n" + " x\n" * 300_000, "- a\n" * 240_000, "a: '" + "x\n" * 400_000,
        "\n" * 900_000,
    ],
    ids=["lists", "mappings", "block", "items", "open quote", "blank"],
)  # fmt: skip
def test_a_full_size_file_takes_bounded_time(text):
    start = time.perf_counter()
    with contextlib.suppress(InputError):
        parse_document(text, "f.yaml")
    assert time.perf_counter() - start < 20.0
