"""The moving view: its numbers by closed form and by the unpacking that its script does, its page in a browser."""

import base64
import json
import re
import shutil
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import browse, needs_browser
from export_sample import beam_history, curve, energies, shell_history
from report_sample import write_run

from knittest.base.errors import InputError
from knittest.base.history import Frame, History, Mesh
from knittest.cli.main import run as command
from knittest.export.meshes import write_frames
from knittest.report_page.moving.page import (
    MODULES,
    STEPS,
    THREE,
    Packer,
    pack_recording,
    quantise_positions,
    write_view,
)
from knittest.report_page.moving.recording import (
    Recording,
    diverging_colours,
    read_recording,
    scale_of,
    scales_of,
    sequential_colours,
    to_cielab,
)  # fmt: skip

MODULE = Path(MODULES["decode"])
GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
SHOWN = re.compile(r'id="data">([^<]+)<')


@pytest.fixture(scope="module", params=["beams", "shells"])
def moved(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = write_run(tmp_path_factory.mktemp("view") / request.param)
    write_frames(folder, beam_history() if request.param == "beams" else shell_history())
    assert command(["view", str(folder)]) == 0
    return folder


def parts(page: Path) -> tuple[dict, bytes]:
    text = page.read_text(encoding="utf-8")
    header = re.search(r'id="header">(.+?)</script>', text)
    data = SHOWN.search(text)
    assert header and data
    return json.loads(header[1]), zlib.decompress(base64.b64decode(data[1]))


def unpacked(data: bytes, entry: dict) -> np.ndarray:
    """Values of an ``entry`` of :meth:`Packer.add` from inflated ``data``, as the script of the page reads them."""
    (k, n, d), width = entry["shape"], entry["width"]
    planes = np.frombuffer(data, np.uint8, width * k * n * d, entry["at"]).reshape(width, d, k, n).astype(np.int64)
    folded = sum((plane << (8 * b) for b, plane in enumerate(planes)), np.zeros((d, k, n), np.int64))
    rest = np.moveaxis((folded >> 1) ^ -(folded & 1), 0, 2)
    return np.cumsum(np.cumsum(rest, axis=1), axis=0) & ((1 << (8 * width)) - 1)


def test_positions_come_back_within_half_a_step_and_fields_within_half_a_colour(moved: Path) -> None:
    recording = read_recording(moved)
    header, data = parts(moved / "view.html")
    place = np.array(header["low"]) + header["step"] * unpacked(data, header["position"])
    assert np.abs(place - recording.position).max() <= 0.5000001 * header["step"]
    assert header["step"] == pytest.approx(np.ptp(recording.position, axis=(0, 1)).max() / STEPS, rel=1e-12)
    np.testing.assert_array_equal(unpacked(data, header["cells"])[0, :, :-1], recording.cells)
    np.testing.assert_array_equal(unpacked(data, header["alive"])[:, :, 0], recording.fields["alive"])
    np.testing.assert_allclose(unpacked(data, header["radius"])[0, :, 0] / 1e3, recording.radius, atol=5e-4)
    names = {scale.label: name for name, scale in scales_of(recording).items()}
    for field in header["fields"]:
        codes, span = unpacked(data, field["codes"])[:, :, 0], field["high"] - field["low"]
        true = np.clip(field["factor"] * recording.fields[names[field["label"]]], field["low"], field["high"])
        assert np.abs(field["low"] + (codes - 1) / 254 * span - true).max() <= 0.5001 * span / 254


@needs_browser
def test_its_script_unpacks_the_same(tmp_path: Path) -> None:
    """Every width, wrapping differences and negative ones, in a browser."""
    rng = np.random.default_rng(3)
    packer = Packer()
    arrays = [(rng.integers(0, 1 << min(8 * w, 31), (3, 7, 2)), w, kind) for w, kind in KINDS.items()]
    entries = [packer.add(values, width) for values, width, _ in arrays]
    calls = ", ".join(f"[...unpacked(data, entries[{k}], {kind})]" for k, (_, _, kind) in enumerate(arrays))
    script = f"""{MODULE.read_text(encoding="utf-8").replace("export ", "")}
    const data = await inflated("{base64.b64encode(packer.deflate()).decode()}"), entries = {json.dumps(entries)};
    document.title = JSON.stringify([{calls}]);
    """
    page = tmp_path / "unpack.html"
    page.write_text(f'<title>nothing</title><script type="module">{script}</script>', encoding="utf-8")
    found = json.loads(browse(tmp_path, "--dump-dom", page.as_uri()).partition("<title>")[2].partition("</title>")[0])
    assert found == [values.ravel().tolist() for values, _, _ in arrays]
    for entry, (values, _, _) in zip(entries, arrays, strict=True):
        np.testing.assert_array_equal(unpacked(bytes(packer.data), entry), values)


KINDS = {1: "Uint8Array", 2: "Uint16Array", 4: "Int32Array"}


def test_37000_nodes_in_20_frames_stay_below_3_mb() -> None:
    """Yarns 300 mm wide that shear, buckle and rattle by 20 µm between nodes and frames, with two fields."""
    frames, nodes = 20, 37000
    rng = np.random.default_rng(5)
    s = np.linspace(0.0, 120 * 2 * np.pi, nodes)
    at_rest = np.column_stack([150 * np.sin(s), 300 * s / s[-1], 1.3 * np.sin(40 * s)])
    time = np.linspace(0.0, 1.0, frames)
    position = np.array([at_rest + np.outer(at_rest[:, 1], [0.6 * t, 0.1 * t, 0.2 * t * t]) for t in time])
    position += 0.02 * rng.standard_normal(position.shape)
    force = 200 * time[:, None] * (1 + np.sin(s)) + 4 * rng.standard_normal((frames, nodes))
    cells = np.column_stack([np.arange(nodes - 1), np.arange(1, nodes)])
    fields = {"axial_force": force[:, 1:], "axial_strain": force[:, 1:] / 46500}
    one = np.ones(nodes - 1)
    recording = Recording("beams", cells, one.astype(int) * 0, ("warp",), 0.3 * one, time, position, fields)
    _, data = pack_recording(recording, scales_of(recording))
    assert 4 / 3 * len(data) < 3e6


def test_one_step_holds_along_all_axes() -> None:
    position = np.array([[[0.0, 0.0, 0.0], [655.35, 0.1, -0.004]]])
    values, low, step = quantise_positions(position)
    assert step == pytest.approx(0.01)
    np.testing.assert_array_equal(values, [[[0, 0, 0], [65535, 10, 0]]])
    np.testing.assert_allclose(low, [0.0, 0.0, -0.004])


def test_a_scale_is_about_zero_where_both_signs_count() -> None:
    both = scale_of("shear_angle", np.radians(np.array([[-10.0, 20.0]])))
    assert both is not None and (both.low, both.high) == (pytest.approx(-both.high), pytest.approx(20.0, rel=0.01))
    assert both.signed and both.unit == "°"
    pull = scale_of("axial_force", np.array([[-0.001, 5.0]]))
    assert pull is not None and not pull.signed and pull.low == 0.0 and pull.least == -0.001
    assert scale_of("axial_force", np.zeros((2, 3))) is None
    broken = scale_of("axial_force", np.array([[1.0, 900.0]]), np.array([[1.0, 0.0]]))
    assert broken is not None and broken.largest == 1.0  # what is gone carries nothing


@pytest.mark.parametrize("colours", [sequential_colours(), diverging_colours()])
def test_equal_steps_of_a_value_look_equally_far_apart(colours: list[str]) -> None:
    rgb = np.array([[int(c[k : k + 2], 16) for k in (1, 3, 5)] for c in colours]) / 255.0
    every_eighth = np.linalg.norm(np.diff(to_cielab(rgb)[::8], axis=0), axis=1)
    assert every_eighth.std() < 0.27 * every_eighth.mean()  # viridis is uniform in a later space than CIELAB
    assert np.linalg.norm(to_cielab(rgb)[0] - to_cielab(rgb)[-1]) > 50
    known = to_cielab(np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 1.0]]))
    np.testing.assert_allclose(known, [[53.24, 80.09, 67.20], [100.0, 0.0, 0.0]], atol=0.05)


def test_the_library_is_what_its_page_says_and_named_on_the_view(moved: Path) -> None:
    import hashlib

    stated = dict(re.findall(r"\| (\S+) \| \S+ \| ([0-9a-f]{64}) \|", (THREE / "README.md").read_text()))
    assert len(stated) == 3
    for name, digest in stated.items():
        assert hashlib.sha256((THREE / name).read_bytes()).hexdigest() == digest
    text = (moved / "view.html").read_text(encoding="utf-8")
    assert "MIT licence" in text and not re.search(r"(src|href)=|https?://", SHOWN.sub("", text))


def test_a_run_without_frames_is_told_what_to_do(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = write_run(tmp_path / "bare")
    assert command(["view", str(folder)]) == 2
    assert "has no frames" in (said := capsys.readouterr().err) and "--no-frames" in said
    assert not (folder / "view.html").exists()
    assert command(["view", str(tmp_path / "nowhere")]) == 2


@pytest.mark.parametrize("damage", ["cut", "outside", "gone", "other"])
def test_damaged_frames_are_refused_by_name(tmp_path: Path, damage: str) -> None:
    folder = write_run(tmp_path / "run")
    write_frames(folder, shell_history())
    frame, collection = folder / "frames/frame-0001.vtu", folder / "frames.pvd"
    if damage == "cut":
        frame.write_bytes(frame.read_bytes()[:500])
    elif damage == "gone":
        frame.unlink()
    elif damage == "other":
        write_frames(tmp_path, beam_history())
        shutil.copy(tmp_path / "frames/frame-0001.vtu", frame)
    else:
        collection.write_text(collection.read_text().replace("frames/frame-0001", "../frame-0001"))
    with pytest.raises(InputError, match="frame-0001"):
        write_view(folder)


def test_a_refused_run_says_so_and_frames_can_be_fewer(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", failures=("kinetic energy 12 % of the internal",))
    write_frames(folder, shell_history())
    text = write_view(folder, 2).read_text(encoding="utf-8")
    assert "Not compared with the experiment: kinetic energy 12 %" in text
    assert parts(folder / "view.html")[0]["position"]["shape"][0] == 2
    with pytest.raises(InputError, match="at least 2"):
        write_view(folder, 1)


@needs_browser
def test_a_browser_draws_it_on_desktop_and_phone(moved: Path, tmp_path: Path) -> None:
    shots = []
    for size, state in (("1000,700", "frame=1"), ("1000,700", "frame=2&colour=height"), ("500,800", "frame=3")):
        dom, shot = drawn(tmp_path, f"{(moved / 'view.html').as_uri()}#{state}", size)
        assert f'data-frame="{int(state[6]) - 1}"' in dom
        shots.append(shot)
        stage = shot[len(shot) // 4 : -len(shot) // 4]
        assert np.mean(np.ptp(stage, axis=(0, 1)) > 0.2) == 1.0
        assert 0.02 < np.mean(np.abs(stage - stage[0, 0]).max(axis=2) > 0.1) < 0.9
    assert np.mean(np.abs(shots[0] - shots[1]).max(axis=2) > 0.05) > 0.01


def drawn(folder: Path, address: str, size: str) -> tuple[str, np.ndarray]:
    """Page of a view and its pixels (rows, columns, 3) in a window of ``size``."""
    import matplotlib.image

    png = folder / "shot.png"
    dom = browse(folder, *GL, f"--window-size={size}", f"--screenshot={png}", "--dump-dom", address)
    assert 'data-state="ready"' in dom, re.search(r'id="trouble".*?</p>', dom)
    return dom, matplotlib.image.imread(png)[:, :, :3]


@needs_browser
def test_a_yarn_covers_what_a_round_tube_with_round_ends_covers(tmp_path: Path) -> None:
    """A straight yarn across the window: 2 r l + pi r^2, to a pixel along its edge."""
    folder, length, radius, wide = write_run(tmp_path / "run"), 10.0, 1.0, 800
    one = np.ones(1, int)
    mesh = Mesh("beams", np.array([[0, 1]]), 0 * one, ("warp",), 0 * one, np.array([radius]))
    ends = np.array([[0.0, 0.0, 0.0], [length, 0.0, 0.0]])
    frames = [Frame(t, t, 1.0, ends, {"axial_force": np.array([5.0]), "alive": np.ones(1)}) for t in (0.0, 1.0)]
    write_frames(folder, History(mesh, curve(1.0), energies(("warp",)), frames))
    _, shot = drawn(tmp_path, f"{write_view(folder).as_uri()}#look=top", f"{wide},700")
    pixel = 1.08 * (length + 2 * radius) / wide
    covered = np.sum(np.ptp(shot[250:-250], axis=2) > 0.05) * pixel**2
    outline = 2 * length + 2 * np.pi * radius
    assert covered == pytest.approx(2 * radius * length + np.pi * radius**2, abs=outline * pixel)


def test_the_report_beside_a_view_links_to_it_and_a_page_of_others_is_left_alone(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "linked")
    write_frames(folder, beam_history())
    report, link = folder / "report.html", 'href="view.html"'
    assert command(["report", str(folder)]) == 0 and link not in report.read_text(encoding="utf-8")
    write_view(folder)
    assert link in report.read_text(encoding="utf-8")
    elsewhere = tmp_path / "elsewhere.html"
    assert command(["report", str(folder), "--out", str(elsewhere)]) == 0
    assert link not in elsewhere.read_text(encoding="utf-8")
    report.write_text("mine")
    write_view(folder)
    assert report.read_text() == "mine"


def test_nodes_of_no_element_take_no_room(tmp_path: Path) -> None:
    """Like those of a periodic cell's images, among the others and far away."""
    folder, history = write_run(tmp_path / "cell"), beam_history()
    own = [frame.position for frame in history.frames]
    mesh = replace(history.mesh, cells=history.mesh.cells + 1)
    frames = [replace(f, position=np.vstack([[1e3, 0.0, 0.0], f.position, [0.0, 1e3, 0.0]])) for f in history.frames]
    write_frames(folder, replace(history, mesh=mesh, frames=frames))
    recording = read_recording(folder)
    np.testing.assert_array_equal(recording.cells, history.mesh.cells)
    np.testing.assert_allclose(recording.position, own, atol=1e-9)


def test_a_field_of_rounding_is_left_out_and_a_shear_of_nothing_comes_last() -> None:
    values = np.linspace(-1.0, 1.0, 50).reshape(2, 25)
    cells = np.arange(100).reshape(25, 4)
    bare = Recording(
        "shells", cells, np.zeros(25, int), ("fabric",), np.ones(25), np.arange(2.0), np.zeros((2, 100, 3)), {}
    )

    def found(shear: float) -> list[str]:
        fields = {"force_warp": values, "shear_angle": shear * values, "strain_weft": 1e-12 * values}
        return list(scales_of(replace(bare, fields=fields)))

    assert found(0.5) == ["shear_angle", "force_warp"]
    assert found(1e-4) == ["force_warp", "shear_angle"]
    assert found(1e-9) == ["force_warp"]
