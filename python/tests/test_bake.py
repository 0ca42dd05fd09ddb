"""Lightmaps as arrays."""

from pathlib import Path

import numpy as np
import pytest

import halflight as hl


def test_a_furnace_is_flat_and_its_faces_lie_in_the_map(tmp_path: Path) -> None:
    maps = hl.bake(hl.load("furnace"), texels=32)
    assert np.abs(maps.irradiance / (np.pi / 2) - 1).max() < 1e-3
    assert maps.met and maps.uv.min() >= 0 and maps.uv.max() <= 1
    # The area of the faces in the map is that of the texels that show them.
    a, b, c = np.moveaxis(maps.uv * 32, 1, 0)
    (p, q), (r, s) = (b - a).T, (c - a).T
    area = np.abs(p * s - q * r).sum() / 2
    assert abs(maps.coverage.sum() - area) < 1e-3 * area
    files = maps.save(tmp_path / "baked")
    assert {Path(file).suffix for file in files} == {".exr", ".png", ".glb", ".json"}
    read = hl.read_picture(next(file for file in files if file.endswith(".exr")))
    assert np.array_equal(read, maps.irradiance)


def test_lamps_add_up_and_bad_arguments_say_so() -> None:
    maps = hl.bake(hl.cornell_box(), texels=48, tolerance=0.1, per="luminaire")
    assert list(maps.luminaires) == ["light"] and maps.luminaire_errors["light"] > 0
    assert np.allclose(maps.mix({}), maps.irradiance, rtol=1e-4, atol=1e-6)
    assert np.allclose(maps.mix({"light": 0.5}), 0.5 * maps.irradiance, rtol=1e-4, atol=1e-6)
    for wrong in [{"texels": 8}, {"tolerance": 0.0}, {"padding": -1}, {"indirect": True, "per": "luminaire"}]:
        with pytest.raises(ValueError):
            hl.bake(hl.cornell_box(), **wrong)
    with pytest.raises(ValueError, match="per="):
        hl.bake(hl.cornell_box(), texels=16, padding=0, tolerance=0.5).mix({})
