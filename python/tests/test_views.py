"""Further views from one solve, what cannot be set, terms that are not kept, and pictures on screens."""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import halflight as hl

ELSEWHERE = hl.Camera([278, 400, -500], [278, 200, 280], vertical_fov=50)


def test_a_view_from_one_solve_is_that_of_a_solve_behind_its_camera(box: hl.Scene, solved: hl.Solution) -> None:
    seen = solved.picture(ELSEWHERE, size=(24, 16), samples=16)
    assert seen.shape == (16, 24, 3) and isinstance(seen, hl.Picture)
    own = hl.solve(box.with_camera(ELSEWHERE), patches=300, rays=64)
    assert np.array_equal(own.picture(size=(24, 16), samples=16), seen)
    assert not np.array_equal(solved.picture(size=(24, 16), samples=16), seen)
    # The solution's own camera is where it was.
    assert np.array_equal(
        solved.picture(box.camera, size=(24, 16), samples=16), solved.picture(size=(24, 16), samples=16)
    )
    terms = solved.pictures(3, ELSEWHERE, size=(24, 16), samples=16)
    assert np.array_equal(terms, own.pictures(3, size=(24, 16), samples=16))
    assert seen.error is None and seen.standard_error is not None and seen.verdict == "converges"


def test_a_view_casts_no_row_of_f(box: hl.Scene) -> None:
    solution = hl.solve(box, patches=1000, rays=1024)
    rows = 1024 * np.count_nonzero(solution.patches.rho.max(axis=1))
    steps: set[str] = set()
    for k in range(3):
        camera = hl.Camera([278, 273, -800 + 10 * k], [278, 273, 0])
        picture = solution.picture(camera, size=(16, 16), samples=16, progress=lambda step, *_: steps.add(step))
        # 16 camera rays a pixel, for each of which one hemisphere ray and one to the lamp.
        assert 16 * 16 * 16 <= picture.rays <= 4 * 16 * 16 * 16 < 0.02 * rows
        assert picture.seconds.form_factors == 0.0 and picture.seconds.gather > 0.0
    assert "form factors" not in steps


def test_a_view_by_a_camera_of_a_file_has_its_name(tmp_path: Path, solved: hl.Solution) -> None:
    with pytest.raises(hl.SceneError, match="no camera"):
        solved.picture("balcony", size=(4, 4))
    with pytest.raises(TypeError, match="camera must be a Camera"):
        solved.picture(3, size=(4, 4))  # type: ignore[arg-type]


def test_highlights_are_those_of_the_camera_that_sees_them(tmp_path: Path) -> None:
    (tmp_path / "room.mtl").write_text("newmtl floor\nKd 0.2 0.2 0.2\nKs 0.7 0.7 0.7\nNs 40\nnewmtl lamp\nKe 9 9 9\n")
    (tmp_path / "room.obj").write_text(
        "mtllib room.mtl\nv -2 0 -2\nv 2 0 -2\nv 2 0 2\nv -2 0 2\nv -.2 2 -.2\nv .2 2 -.2\nv .2 2 .2\nv -.2 2 .2\n"
        "o floor\nusemtl floor\nf 4 3 2 1\no lamp\nusemtl lamp\nf 5 6 7 8\n"
    )
    scene = hl.load(tmp_path / "room.obj", highlights=True)
    solution = hl.solve(scene, patches=100, rays=16)
    cameras = [hl.Camera([x, 1.5, 3.0], [0, 0, 0]) for x in (-2.0, 2.0)]
    for camera in cameras:
        seen = solution.picture(camera, size=(16, 16), samples=16)
        fresh = hl.solve(scene.with_camera(camera), patches=100, rays=16).picture(size=(16, 16), samples=16)
        assert np.array_equal(seen, fresh) and seen.max() > 0


def test_what_would_do_nothing_cannot_be_set(box: hl.Scene, lamps: hl.Scene, solved: hl.Solution) -> None:
    picture = hl.render(box, size=(8, 8), tolerance=0.5)
    apart = hl.solve(lamps, per="luminaire", patches=50, rays=16)
    cases: list[tuple[Any, str]] = [
        (box, "with_material"),
        (solved, "solve again"),
        (solved.bounces, "solve again"),
        (solved.patches, "solve again"),
        (solved.operator, "solve again"),
        (apart, "mix"),
        (picture, "numpy.array"),
        (hl.patch_factors(box, patches=50, rays=16), "patch_factors"),
    ]
    for owner, instead in cases:
        for name in ("tolerance", "foo", "light"):
            with pytest.raises(AttributeError, match=f"'{name}' cannot be set.*never changes.*{instead}"):
                setattr(owner, name, 1)
        again = pickle.loads(pickle.dumps(owner))
        with pytest.raises(AttributeError, match="cannot be set"):
            again.foo = 1
    with pytest.raises(AttributeError, match="cannot be set"):
        del box.name  # type: ignore[misc]
    for frozen in (hl.Material("m"), box.camera, solved.bounces[0], hl.PointLight([0, 0, 0], 1)):
        with pytest.raises(AttributeError):
            frozen.foo = 1  # type: ignore[union-attr]


def test_terms_that_are_not_kept_are_in_light_and_figures(box: hl.Scene, tmp_path: Path) -> None:
    whole, few = (hl.solve(box, patches=300, rays=64, keep=keep) for keep in (None, 3))
    assert whole.bounces.kept == len(whole.bounces) == len(few.bounces) > few.bounces.kept == 3
    assert np.array_equal(few.light, whole.light) and np.array_equal(few.left, whole.left)  # type: ignore[arg-type]
    for name in ("power", "power_invisible", "norm", "ratio", "tail_bound"):
        assert np.array_equal(getattr(few.bounces, name), getattr(whole.bounces, name), equal_nan=True)
    assert np.array_equal(few.bounces[2].light, whole.bounces[2].light)
    with pytest.raises(ValueError, match="term 3 was not kept.*keep=4"):
        few.bounces[3].light  # noqa: B018
    pictures = [one.picture(size=(16, 16), samples=16) for one in (few, whole)]
    assert np.allclose(*pictures, rtol=1e-6) and "K2E" in few._repr_html_()
    assert few.pictures(size=(8, 8), samples=8).shape[0] == 3
    with pytest.raises(ValueError, match="count must be from 0 to 2"):
        few.pictures(3, size=(8, 8))
    with pytest.raises(ValueError, match="solve without keep"):
        few.save(tmp_path / "kept")
    again = pickle.loads(pickle.dumps(few))
    assert again.bounces.kept == 3 and np.array_equal(again.light, few.light)
    counted = hl.solve(box, patches=300, rays=64, bounces=6, keep=1)
    assert counted.bounces.kept == 1 and len(counted.bounces) == 7
    for wrong in (0, -1, 1.5, "all"):
        with pytest.raises((TypeError, ValueError), match="keep"):
            hl.solve(box, patches=50, rays=16, keep=wrong)  # type: ignore[call-overload]
    with pytest.raises(ValueError, match="keeps no terms"):
        hl.solve(box, patches=50, rays=16, keep=2, per="luminaire")  # type: ignore[call-overload]


MEMORY = """
import re, sys, halflight as hl
room, keep = hl.load("furnished-room"), eval(sys.argv[1])
found = hl.solve(room, alpha=0.79, tau=1.0, patches=3000, rays=32, truncation=1e-6, keep=keep)
print(len(found.bounces), len(found.patches), re.search(r"VmHWM:\\s+(\\d+) kB", open("/proc/self/status").read())[1])
"""


def test_near_the_frontier_memory_is_that_of_the_terms_that_are_kept() -> None:
    def measured(keep: str) -> tuple[int, int, int]:
        done = subprocess.run([sys.executable, "-c", MEMORY, keep], capture_output=True, text=True, check=True)
        terms, patches, kib = map(int, done.stdout.split())
        return terms, patches, 1024 * kib

    if not Path("/proc/self/status").exists():
        pytest.skip("the system does not say how much memory was used at most")
    terms, patches, all_of_them = measured("None")
    few = measured("2")
    assert few[:2] == (terms, patches) and terms > 300
    assert 0.7 * 24 * patches * terms < all_of_them - few[2] < 1.5 * 24 * patches * terms


def test_srgb_is_what_png_files_hold(box: hl.Scene, tmp_path: Path) -> None:
    picture = hl.render(box, size=(24, 16), tolerance=0.2)
    for exposure in (0.0, 1.5, "auto"):
        picture.save(tmp_path / "a.png", exposure=exposure)
        codes = picture.srgb(exposure)
        assert codes.dtype == np.uint8 and codes.shape == (16, 24, 3)
        # Reading undoes the curve, of which every code comes back.
        assert np.array_equal(hl.srgb(hl.read_picture(tmp_path / "a.png")), codes)
        hl.save_picture(tmp_path / "b.png", np.asarray(picture), exposure=exposure)
        assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    # 255 (1.055 0.5^(1/2.4) - 0.055) = 187.52.
    assert hl.srgb(np.full((1, 1, 3), [0.0, 0.5, 1e9])).tolist() == [[[0, 188, 255]]]
    # Nine in ten of what is lit is half as bright as white at most, whatever the unit of light.
    assert hl.exposure(8 * np.asarray(picture)) == pytest.approx(hl.exposure(picture) - 3, abs=1e-5)
    y = np.asarray(picture, float) @ [0.2126, 0.7152, 0.0722] * 2.0 ** hl.exposure(picture)
    assert (y[y > 0] <= 0.5 * (1 + 1e-5)).mean() >= 0.9 and hl.exposure(np.zeros((2, 2, 3))) == 0.0
    for wrong in ("bright", float("nan"), None, 1e9):
        with pytest.raises((TypeError, ValueError), match="exposure"):
            picture.srgb(wrong)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="picture"):
        hl.srgb(np.zeros((3, 3)))


def test_the_program_exposes_scenes_of_ones_own_alike(program: Callable[..., None], tmp_path: Path) -> None:
    mesh = Path(__file__).resolve().parents[2] / "tests" / "data" / "welcome" / "room.obj"
    program(tmp_path, f"render {mesh} --light sky --mode local --size 16x16 --tolerance 0.2 -o theirs.png")
    with pytest.warns(hl.SceneWarning):
        scene = hl.load(mesh, light="sky")
    hl.render(scene, mode="local", size=(16, 16), tolerance=0.2).save(tmp_path / "ours.png", exposure="auto")
    assert (tmp_path / "ours.png").read_bytes() == (tmp_path / "theirs.png").read_bytes()


def test_plots_show_what_they_are_of(box: hl.Scene) -> None:
    plt = pytest.importorskip("matplotlib.pyplot")
    picture = hl.render(box, size=(40, 30), patches=100, rays=16, samples=8)
    (image,) = picture.plot(exposure=1).images
    assert np.array_equal(image.get_array(), picture.srgb(1)) and image.origin == "upper"
    mapped = hl.stability_map(box, grid=5, patches=100, rays=16)
    ax = mapped.plot()
    assert ax.get_xlabel().startswith("alpha") and ax.get_ylabel().startswith("tau")
    (mesh,) = [one for one in ax.collections if one.get_array() is not None and one.get_array().size == 25]
    # The colour at the lower right corner is that of alpha 1 and tau 0.
    shown = mesh.get_array().reshape(5, 5)
    assert np.allclose(shown, 0.5 * (mapped.lower + mapped.upper)) and shown[0, 4] > shown[0, 0] == 0.0
    plt.close("all")


def test_bounces_are_a_table(solved: hl.Solution) -> None:
    pytest.importorskip("pandas")
    bounces, frame = solved.bounces, solved.bounces.to_pandas()
    assert frame.index.name == "n" and list(frame.index) == list(range(len(bounces)))
    assert np.array_equal(frame[["power_r", "power_g", "power_b"]], bounces.power)
    assert np.array_equal(frame["power_invisible_g"], bounces.power_invisible[:, 1])
    assert np.array_equal(frame["tail_bound"], bounces.tail_bound) and np.isnan(frame["ratio"][0])
    assert np.allclose(frame["norm"][1:] / frame["norm"].to_numpy()[:-1], frame["ratio"][1:])
    html = bounces._repr_html_()
    assert html.startswith("<table>") and "K2E" in html and f"{bounces.norm[2]:.4g}" in html
