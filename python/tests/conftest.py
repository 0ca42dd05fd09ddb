"""What the tests share: scenes, and the program that the arrays are compared with."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

import halflight as hl

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def box() -> hl.Scene:
    return hl.cornell_box()


@pytest.fixture(scope="session")
def solved(box: hl.Scene) -> hl.Solution:
    return hl.solve(box, patches=300, rays=64)


@pytest.fixture(scope="session")
def lamps() -> hl.Scene:
    """A closed room with two lamps below its ceiling and a table."""
    return office()


def office() -> hl.Scene:
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    material: list[int] = []
    of: list[int] = []

    def quad(corners: list[list[float]], kind: int, own: int) -> None:
        start = len(vertices)
        vertices.extend(corners)
        faces.append([start, start + 1, start + 2, start + 3])
        material.append(kind)
        of.append(own)

    w, h, d = 4.0, 2.5, 3.0
    quad([[0, 0, 0], [0, 0, d], [w, 0, d], [w, 0, 0]], 0, 0)
    quad([[0, h, 0], [w, h, 0], [w, h, d], [0, h, d]], 0, 1)
    quad([[0, 0, 0], [w, 0, 0], [w, h, 0], [0, h, 0]], 0, 2)
    quad([[0, 0, d], [0, h, d], [w, h, d], [w, 0, d]], 0, 2)
    quad([[0, 0, 0], [0, h, 0], [0, h, d], [0, 0, d]], 0, 2)
    quad([[w, 0, 0], [w, 0, d], [w, h, d], [w, h, 0]], 0, 2)
    for k, x in enumerate([0.8, 2.6]):
        quad([[x, 2.4, 1.2], [x + 0.6, 2.4, 1.2], [x + 0.6, 2.4, 1.8], [x, 2.4, 1.8]], 1, 3 + k)
    quad([[1, 0.7, 1], [1, 0.7, 2], [2, 0.7, 2], [2, 0.7, 1]], 2, 5)
    materials = [
        hl.Material("wall", 0.6),
        hl.Material("lamp", 0.0, emission=10.0),
        hl.Material("wood", [0.5, 0.4, 0.3], two_sided=True),
    ]
    names = ["floor", "ceiling", "walls", "left", "right", "table"]
    camera = hl.Camera([2, 1.5, 2.9], [2, 1, 0], vertical_fov=70)
    return hl.Scene(vertices, faces, materials, material, objects=names, face_object=of, camera=camera, name="office")


@pytest.fixture(scope="session")
def program() -> Callable[..., None]:
    """Runs the program in a folder; the tests that need it are skipped where it is not built."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    found = os.environ.get("HALFLIGHT_PROGRAM") or shutil.which(target / "release" / "halflight")
    if not found:
        pytest.skip("the program is not built: cargo build --release")

    def run(folder: Path, words: str, threads: int = 2) -> None:
        command = [found, *words.split(), "--out", str(folder), "--threads", str(threads)]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr

    return run
