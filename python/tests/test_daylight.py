"""Daylight and exchange by radiation as arrays."""

from pathlib import Path

import numpy as np
import pytest

import halflight as hl


def floor() -> hl.Scene:
    return hl.Scene.from_objects({"floor": hl.quad([-1, 0, -1], [0, 0, 2], [2, 0, 0])})


def test_an_open_floor_sees_all_of_the_sky() -> None:
    found = hl.daylight(floor(), [[0, 1, 0], [0.5, 1, 0]], mf=2, bounces=0, sky="overcast")
    assert found.D.shape == found.error.shape == (2, 578, 3) and found.met
    assert np.allclose(found.D[:, 1:, 0].sum(axis=1), np.pi, rtol=1e-5)
    assert abs(found.solid_angle[1:].sum() - 2 * np.pi) < 1e-9
    assert np.allclose(found.factor, 1.0, rtol=3e-3) and found.year is None
    assert found.luminance is not None and found.lux is not None
    assert np.allclose(found.lux[:, 0], found.D[:, :, 0] @ found.luminance[0], rtol=1e-5)


def test_a_scene_under_patches_has_what_coefficients_say() -> None:
    radiance = np.arange(146) % 7.0
    found = hl.daylight(floor(), [[0, 1, 0]], bounces=0)
    points = hl.points(floor().with_sky_patches(radiance), [[0, 1, 0]], [0, 1, 0])
    assert abs(points.irradiance[0, 0] - found.D[0, :, 0] @ radiance) < 4 * points.error[0, 0] + 1e-3


def test_a_weather_file_has_hours(tmp_path: Path) -> None:
    file = tmp_path / "day.wea"
    head = "place A_B\nlatitude 40\nlongitude 0\ntime_zone 0\nsite_elevation 0\nweather_data_file_units 1\n"
    file.write_text(head + "6 21 11.5 700 120\n6 21 23.5 0 0\n")
    found = hl.daylight(floor(), [[0, 1, 0]], sky=file, tolerance=0.1)
    assert found.lux is not None and found.sunlight is not None and found.year is not None
    assert found.lux.shape == (1, 2) and found.lux[0, 1] == 0 and 0.5 * found.lux[0, 0] < found.sunlight[0, 0]
    assert (found.year.sda, found.year.ase, found.year.hours) == (1.0, 0.0, 1.0)
    file.write_text(head + "6 21 11.5 700\n")
    with pytest.raises(ValueError, match="line 7"):
        hl.daylight(floor(), [[0, 1, 0]], sky=file)
    with pytest.raises(OSError):
        hl.daylight(floor(), [[0, 1, 0]], sky=tmp_path / "none.epw")


@pytest.mark.parametrize(
    "wrong",
    [{"sky": "snow"}, {"mf": 9}, {"tolerance": 0}, {"north": [0, 1, 0]}, {"sky": ("clear", 100, 0)}, {"hours": (9, 8)}],
)
def test_bad_arguments_say_so(wrong: dict[str, object]) -> None:
    with pytest.raises(ValueError):
        hl.daylight(floor(), [[0, 1, 0]], **wrong)  # type: ignore[arg-type]


def test_two_plates_exchange_what_the_textbook_has() -> None:
    factors = hl.factors(hl.load("furnace"))
    found = factors.exchange({name: 0.4 for name in factors.names})
    # All of what a closed room of one emissivity emits is absorbed within it.
    assert np.allclose(found.row_sums, 1.0, atol=1e-6) and np.allclose(found.net.sum(axis=1), 0.0, atol=1e-6)
    for wrong in [{"nothing": 0.5}, [0.0] * len(factors.names), [0.5, 0.5] * len(factors.names)]:
        with pytest.raises(ValueError):
            factors.exchange(wrong)
