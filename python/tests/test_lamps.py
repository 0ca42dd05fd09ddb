"""Lamps of other strengths: dimmed to an illuminance, relit from files, and on pages."""

from __future__ import annotations

import html
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import halflight as hl

AT = [[1.1, 0.71, 1.5], [2.9, 0.71, 1.5], [2.0, 1.0, 1.0]]


@pytest.fixture(scope="module")
def light(lamps: hl.Scene) -> hl.Irradiance:
    return hl.points(lamps, AT, [0, 1, 0], tolerance=0.05, per="luminaire")


def test_one_lamp_is_dimmed_by_the_ratio_of_illuminances() -> None:
    lamp = hl.PointLight([0, 2, 0], 10.0, "lamp")
    floor = hl.Scene.from_objects({"floor": hl.quad([-1, 0, -1], [0, 0, 2], [2, 0, 0])}, lights=[lamp])
    E = hl.points(floor, [[0, 0, 0]], [0, 1, 0], mode="local", per="luminaire")
    # 10 W/sr at 2 m: 2.5 W/m² of white light, 683 lm/W.
    assert E.lux[0] == pytest.approx(2.5 * 683, rel=1e-5)
    assert E.dim(500)["lamp"] == pytest.approx(500 / (2.5 * 683), rel=1e-5)
    assert E.dim(1e6) == {"lamp": 1.0} and E.dim(0) == {"lamp": 0.0}
    assert hl.lux(E.mix(E.dim(500))) == pytest.approx([500.0])


def test_several_lamps_are_dimmed_by_least_squares(light: hl.Irradiance) -> None:
    optimize = pytest.importorskip("scipy.optimize")
    names = list(light.luminaires)
    lit = np.column_stack([hl.lux(light.luminaires[name]) for name in names])
    for wanted in (lit @ [0.3, 0.8], lit @ [0.0, 1.0], np.array([100.0, 900.0, 300.0])):
        found = light.dim(wanted)
        best = optimize.lsq_linear(lit, wanted, bounds=(0.0, 1.0)).x
        assert list(found) == names and list(found.values()) == pytest.approx(best, abs=1e-5)
    # Points without a wish do not count, and lamps that are given stay.
    half = light.dim([np.nan, 0.5 * light.lux[1], np.nan], {"left": 0.25})
    assert half["left"] == 0.25
    expected = (0.5 * light.lux[1] - 0.25 * lit[1, names.index("left")]) / lit[1, names.index("right")]
    assert half["right"] == pytest.approx(expected, rel=1e-5)
    assert light.dim(100, {"left": [1, 0, 0], "right": 0}) == {"left": [1, 0, 0], "right": 0}


def test_what_cannot_be_dimmed_is_said(light: hl.Irradiance, box: hl.Scene) -> None:
    for words, wrong in [("0 or more", -1), ("lux must be", "bright"), ("one for each point", [1, 2]), ("NaN", np.nan)]:
        with pytest.raises((TypeError, ValueError), match=words):
            light.dim(wrong)
    with pytest.raises(ValueError, match="luminaire"):
        light.dim(100, {"desk": 1})
    with pytest.raises(ValueError, match="no luminaires apart"):
        hl.points(box, [[100, 50, 100]], [0, 1, 0], tolerance=0.5).dim(100)


def report(folder: Path, light: hl.Irradiance, picture: hl.Picture) -> Path:
    """A report as the program writes it, of what was found here."""
    picture.save(folder / "room.exr")
    points = [
        {
            "name": name,
            "position": list(light.positions[k]),
            "luminaires": {lamp: list(own[k]) for lamp, own in light.luminaires.items()},
        }
        for k, name in enumerate(["near", "far", None])
    ]
    powers = [{"name": n, "emitted": list(p), "reflected": [1, 2, 3]} for n, p in picture.luminaires.items()]
    file = folder / "room.json"
    file.write_text(
        json.dumps({"modes": [{"luminaires": powers, "points": points, "files": ["room.exr"]}], "files": []})
    )
    return file


@pytest.fixture(scope="module")
def picture(lamps: hl.Scene) -> hl.Picture:
    return hl.render(lamps, size=(24, 18), tolerance=0.2, layers="luminaires")


def test_files_are_relit_as_mixtures_are(tmp_path: Path, light: hl.Irradiance, picture: hl.Picture) -> None:
    file = report(tmp_path, light, picture)
    factors = {"left": 0.25, "right": [0.0, 1.0, 2.0]}
    relit = hl.relight(file, factors)
    assert relit.picture is not None and np.allclose(relit.picture, picture.mix(factors), rtol=1e-6)
    assert np.allclose(relit.irradiance, light.mix(factors)) and np.allclose(relit.lux, hl.lux(light.mix(factors)))
    assert relit.names == ["near", "far", None] and np.allclose(relit.positions, AT) and relit.left_over is None
    assert relit.reflected["right"].tolist() == [0.0, 2.0, 6.0] and relit.factors["left"].tolist() == [0.25] * 3
    assert np.allclose(relit.emitted["left"], 0.25 * picture.luminaires["left"])
    # An EXR file alone has the picture and nothing else.
    alone = hl.relight(tmp_path / "room.exr", {"left": 0})
    assert np.allclose(alone.picture, picture.layers["lamp.right"]) and len(alone.lux) == 0 and alone.emitted == {}
    assert alone.error is None and relit.error is None  # the report above has none


def test_files_are_dimmed_as_points_are(tmp_path: Path, light: hl.Irradiance, picture: hl.Picture) -> None:
    file = report(tmp_path, light, picture)
    found = hl.relight(file, lux=300)
    assert {n: f[0] for n, f in found.factors.items()} == pytest.approx(light.dim(300), abs=1e-9)
    off = np.abs(found.lux - 300)
    assert found.left_over == pytest.approx((np.sqrt(np.mean(off**2)), off.max()))
    named = hl.relight(file, {"left": 0.0}, lux={"far": 200})
    assert named.factors["left"].tolist() == [0, 0, 0] and named.lux[1] == pytest.approx(200)
    wanted = [np.nan, 200, np.nan]
    assert named.factors["right"][0] == pytest.approx(hl.relight(file, {"left": 0.0}, lux=wanted).factors["right"][0])


def test_what_cannot_be_relit_is_said(tmp_path: Path, light: hl.Irradiance, picture: hl.Picture, box: hl.Scene) -> None:
    file = report(tmp_path, light, picture)
    hl.render(box, size=(8, 8), patches=50, rays=16).save(tmp_path / "whole.exr")
    (tmp_path / "several.json").write_text('{"modes": [{}, {}], "files": []}')
    (tmp_path / "broken.json").write_text("{")
    cases: list[tuple[str, Callable[[], object]]] = [
        ("luminaire", lambda: hl.relight(file, {"desk": 0.5})),
        ("0 or more", lambda: hl.relight(file, {"left": -1})),
        ("no point|none of this name", lambda: hl.relight(file, lux={"nowhere": 300})),
        ("no points", lambda: hl.relight(tmp_path / "room.exr", lux=300)),
        ("no light of single lamps", lambda: hl.relight(tmp_path / "whole.exr")),
        ("report of 2 modes", lambda: hl.relight(tmp_path / "several.json")),
        ("is no report", lambda: hl.relight(tmp_path / "broken.json")),
        ("cannot be read", lambda: hl.relight(tmp_path / "nothing.json")),
        ("file must be a path", lambda: hl.relight(3)),  # type: ignore[arg-type]
    ]
    for words, call in cases:
        with pytest.raises((TypeError, ValueError, OSError), match=words):
            call()


def test_the_program_relights_alike(tmp_path: Path, picture: hl.Picture, program: Callable[..., None]) -> None:
    picture.save(tmp_path / "room.exr")
    program(tmp_path, "relight room.exr --lamp left=0.3 --lamp right=1,0.5,0.2 -o theirs.exr")
    ours = hl.relight(tmp_path / "room.exr", {"left": 0.3, "right": [1, 0.5, 0.2]}).picture
    assert np.array_equal(ours, hl.read_picture(tmp_path / "theirs.exr"))


def test_pages_are_those_of_the_program(tmp_path: Path, box: hl.Scene, program: Callable[..., None]) -> None:
    words = "explore cornell-box --patches 100 --rays 32 --terms 2 --taus 2 --title Box --attribution Cornell -o a.html"
    program(tmp_path, words)
    page = hl.explore(
        box, tmp_path / "b.html", title="Box", attribution="Cornell", patches=100, rays=32, terms=2, taus=2
    )
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()
    assert page.bytes == (tmp_path / "b.html").stat().st_size and page.lamps == 1 and page.patches >= 100
    assert page.file == str(tmp_path / "b.html") and 0 < page.tau_error < 1 and page.rms is not None and page.rms < 0.5


def test_a_notebook_shows_a_page(box: hl.Scene) -> None:
    page = hl.explore(box, story=True, patches=50, rays=16, terms=2, taus=2)
    shown = page._repr_html_()
    assert page.file is None and len(page.html.encode()) == page.bytes and '"story":true' in page.html
    assert shown.startswith("<iframe srcdoc=") and html.unescape(shown.split('"')[1]) == page.html


def test_a_page_says_what_it_needs(tmp_path: Path, box: hl.Scene) -> None:
    small = {"patches": 50, "rays": 16, "terms": 2, "taus": 2}
    with pytest.raises(OSError, match="folder that is there"):
        hl.explore(box, tmp_path / "nowhere" / "a.html", **small)
    with pytest.raises(OSError, match="cannot be written"):
        hl.explore(box, tmp_path, **small)
    for name, wrong in [
        ("patches", 10**6),
        ("rays", 0),
        ("terms", 1),
        ("taus", 18),
        ("title", 3),
        ("seed", -1),
        ("tolerance", 2),
        ("megabytes", 0),
    ]:
        with pytest.raises((TypeError, ValueError), match=name):
            hl.explore(box, tmp_path / "a.html", **{**small, name: wrong})
    with pytest.raises(hl.SceneError, match="emits"):
        hl.explore(box.with_material("light", emission=0), tmp_path / "a.html", **small)
    assert list(tmp_path.iterdir()) == []
