"""For the same seed the arrays are what the program writes, bit by bit, on any number of threads."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import halflight as hl

Program = Callable[..., None]


def test_pictures(box: hl.Scene, program: Program, tmp_path: Path) -> None:
    program(tmp_path, "render cornell-box --mode global --size 40x30 --tolerance 0.1 --seed 3 -o a.exr")
    program(tmp_path, "render cornell-box --alpha 0.5 --tau 0.3 --size 40x30 --patches 300 --samples 16 -o b.exr", 1)
    program(tmp_path, "trace cornell-box --mode global --size 40x30 --samples 9 --seed 5 -o c.exr")
    read = [hl.read_picture(tmp_path / f"{name}.exr") for name in "abc"]
    assert np.array_equal(hl.render(box, mode="global", size=(40, 30), tolerance=0.1, seed=3), read[0])
    assert np.array_equal(hl.render(box, alpha=0.5, tau=0.3, size=(40, 30), patches=300, samples=16), read[1])
    assert np.array_equal(hl.trace(box, mode="global", size=(40, 30), samples=9, seed=5), read[2])


def test_saved_pictures_have_the_same_bytes(box: hl.Scene, program: Program, tmp_path: Path) -> None:
    words = "render cornell-box --mode global --size 24x24 --tolerance 0.1 --layers bounces,luminaires"
    program(tmp_path, words + " --standard-error -o theirs.exr")
    program(tmp_path, "render cornell-box --mode global --size 24x24 --tolerance 0.1 --exposure 1 -o theirs.png")
    picture = hl.render(box, mode="global", size=(24, 24), tolerance=0.1, layers=["bounces", "luminaires"])
    picture.save(tmp_path / "ours.exr", standard_error=True)
    hl.render(box, mode="global", size=(24, 24), tolerance=0.1).save(tmp_path / "ours.png", exposure=1)
    for kind in ("exr", "png"):
        assert (tmp_path / f"ours.{kind}").read_bytes() == (tmp_path / f"theirs.{kind}").read_bytes()


def test_folders_are_the_same_and_open_as_they_were(box: hl.Scene, program: Program, tmp_path: Path) -> None:
    program(
        tmp_path, "bounces cornell-box --alpha 0.9 --tau 0.2 --count 5 --patches 300 --rays 64 --save theirs --size 8x8"
    )
    solution = hl.solve(box, alpha=0.9, tau=0.2, patches=300, rays=64, bounces=5)
    solution.save(tmp_path / "ours")
    names = sorted(path.name for path in (tmp_path / "theirs").iterdir())
    assert names == sorted(path.name for path in (tmp_path / "ours").iterdir()) and "F.npz" in names
    for name in names:
        assert (tmp_path / "ours" / name).read_bytes() == (tmp_path / "theirs" / name).read_bytes(), name
    assert np.array_equal(np.load(tmp_path / "theirs" / "L.npy"), solution.light)
    again = hl.open(tmp_path / "theirs")
    terms = np.load(tmp_path / "theirs" / "terms.npy")
    assert np.array_equal(again.light, solution.light) and len(again.bounces) == len(terms)
    assert all(np.array_equal(bounce.light, term) for bounce, term in zip(again.bounces, terms))
    assert again.radius == solution.radius and repr(again) == repr(solution)


def test_tables(box: hl.Scene, program: Program, tmp_path: Path) -> None:
    program(tmp_path, "factors concentric-spheres --tolerance 0.01")
    program(tmp_path, "map cornell-box --grid 5 --patches 300 --rays 64")
    program(tmp_path, "bounces cornell-box --mode global --count 2 --tolerance 0.05 --size 8x8")
    points = [[100.0, 50.0, 100.0], [278.0, 200.0, 300.0]]
    (tmp_path / "p.csv").write_text("\n".join(",".join(map(str, [*p, 0, 1, 0])) for p in points))
    program(tmp_path, "render cornell-box --mode global --tolerance 0.1 --size 8x8 --points p.csv")

    theirs = np.load(tmp_path / "concentric-spheres-factors.npz")
    found = hl.factors(hl.load("concentric-spheres"), tolerance=0.01)
    assert any(np.array_equal(found.matrix, theirs[name]) for name in theirs.files)

    mapped = hl.stability_map(box, grid=5, patches=300, rays=64)
    table = np.loadtxt(tmp_path / "cornell-box-map.csv", delimiter=",", skiprows=1)
    # The program's rows go by alpha, then tau; axis 0 of the arrays is tau.
    assert np.array_equal(table[:, 0].reshape(5, 5).T[0], mapped.alpha)
    assert np.array_equal(table[:, 1].reshape(5, 5).T[:, 0], mapped.tau)
    assert np.array_equal(table[:, 2].reshape(5, 5).T, mapped.lower)
    assert np.array_equal(table[:, 3].reshape(5, 5).T, mapped.upper)

    series = hl.bounces(box, 2, mode="global", tolerance=0.05)
    rows = np.genfromtxt(tmp_path / "cornell-box-bounces.csv", delimiter=",", names=True)
    power = np.column_stack([rows[f"power_{c}"] for c in "rgb"])
    assert np.array_equal(power, series.bounces.power)
    assert np.array_equal(rows["error"], series.bounces.error)

    light = hl.points(box, points, [0, 1, 0], mode="global", tolerance=0.1)
    (written,) = tmp_path.glob("*points*.csv")
    rows = np.genfromtxt(written, delimiter=",", names=True)
    assert np.array_equal(np.column_stack([rows[f"irradiance_{c}"] for c in "rgb"]), light.irradiance)
    assert np.array_equal(np.column_stack([rows[f"error_{c}"] for c in "rgb"]), light.error)


SUMS = """
import hashlib, halflight as hl, numpy as np
box = hl.cornell_box()
solution = hl.solve(box, patches=300, rays=64)
arrays = [hl.render(box, size=(24, 24), tolerance=0.1), solution.light, solution.operator @ solution.light]
arrays += [hl.points(box, [[100, 50, 100]], [0, 1, 0], tolerance=0.05).irradiance]
print([hashlib.sha256(np.ascontiguousarray(a).tobytes()).hexdigest() for a in arrays])
"""


def test_any_number_of_threads() -> None:
    def sums(threads: int) -> str:
        command = [sys.executable, "-c", SUMS]
        import os

        run = subprocess.run(
            command, env={**os.environ, "RAYON_NUM_THREADS": str(threads)}, capture_output=True, text=True
        )
        assert run.returncode == 0, run.stderr
        return run.stdout

    assert sums(1) == sums(3)


@pytest.mark.parametrize("seed", [0, 7])
def test_the_seed_alone_decides(box: hl.Scene, seed: int) -> None:
    one, two = (hl.solve(box, patches=300, rays=64, seed=seed) for _ in range(2))
    assert np.array_equal(one.light, two.light)
    other = hl.solve(box, patches=300, rays=64, seed=seed + 1)
    assert not np.array_equal(one.light, other.light)
