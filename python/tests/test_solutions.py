"""Solutions against closed forms, SciPy and themselves: series, K, lamps, factors, maps, points."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import halflight as hl

scipy_sparse = pytest.importorskip("scipy.sparse")
linalg = pytest.importorskip("scipy.sparse.linalg")


def test_a_furnace_is_as_bright_as_its_closed_form() -> None:
    # A closed cube that emits 0.25 and reflects 0.5: L = E/(1 - rho) = 0.5, KⁿE = 0.25/2ⁿ. Rows of F sum to 1 to
    # rounding, so the series' own truncation is all that is left out.
    solution = hl.solve(hl.load("furnace"), patches=24, rays=64)
    assert np.allclose(solution.light, 0.5, atol=0.5 * 1e-4 * 2)
    for bounce in solution.bounces[:4]:
        assert np.allclose(bounce.light, 0.25 / 2**bounce.n, rtol=1e-5)
        assert bounce.power == pytest.approx(math.pi * solution.patches.areas.sum() * 0.25 / 2**bounce.n, rel=1e-5)
    assert solution.radius[0] <= 0.5 + 1e-5 and solution.radius[1] >= 0.5 - 1e-5
    assert solution.closure is not None and solution.closure == pytest.approx((0.0, 0.0, 0.0), abs=1e-5)


def test_terms_add_up_and_bounds_hold(solved: hl.Solution) -> None:
    total = sum(np.asarray(bounce.light, np.float64) for bounce in solved.bounces)
    assert np.allclose(total, solved.light, rtol=1e-5)
    areas = solved.patches.areas
    norm = lambda x: math.sqrt((areas[:, None, None] * x**2).sum() / (6 * areas.sum()))  # noqa: E731
    later = np.asarray(solved.light, np.float64)
    for bounce in solved.bounces[:-1]:
        later = later - bounce.light
        # Rounding of the sum in single precision is as large as the light itself times 1e-6.
        assert norm(later) <= bounce.tail_bound + 1e-6 * norm(solved.light)
    assert solved.bounces.norm[1] == pytest.approx(norm(solved.bounces[1].light), rel=1e-6)
    assert [bounce.n for bounce in solved.bounces] == list(range(len(solved.bounces)))
    assert repr(solved.bounces[-1]) == repr(solved.bounces[len(solved.bounces) - 1])
    with pytest.raises(IndexError):
        solved.bounces[len(solved.bounces)]


@pytest.mark.parametrize(
    "name, mode", [("cornell-box", "global"), ("furnished-room", "global"), ("two-rooms", "shadowless")]
)
def test_scipy_agrees_with_the_series_and_its_bounds(name: str, mode: hl._arguments.Mode) -> None:
    solution = hl.solve(hl.load(name), mode=mode, patches=300, rays=64, bounces=400 if mode == "global" else 60)
    K = solution.operator
    x = K.first_bounce.ravel()
    found, info = linalg.gmres(K.one_minus(), x, rtol=1e-6, maxiter=200)
    assert info == 0
    if solution.verdict in ("converges", "ends"):
        light = K.emission + found.reshape(-1, 2, 3)
        # What the series and what the residual leave out, over 1 - radius, and rounding of single precision.
        scale = np.abs(solution.light).max()
        assert np.abs(light - solution.light).max() <= 1e-4 * scale / (1 - solution.radius[1])
    largest = max(abs(linalg.eigs(K, k=1, which="LM", return_eigenvectors=False, tol=1e-4, ncv=40)))
    lower, upper = solution.radius
    assert lower * (1 - 2e-3) <= largest <= upper * (1 + 2e-3)


def test_k_by_its_blocks_and_by_f(solved: hl.Solution) -> None:
    K, rng = solved.operator, np.random.default_rng(1)
    n = len(K.patches)
    x = rng.random((n, 2, 3)).astype(np.float32)
    y = K.matvec(x)
    for c in range(3):
        assert np.allclose(K.matrix(c) @ x[:, :, c].ravel(), y[:, :, c].ravel(), rtol=1e-4, atol=1e-6)
    incident = K.F @ x[:, 0]
    assert np.allclose(y[:, 1], K.patches.rho * incident, rtol=1e-4, atol=1e-6)
    assert np.allclose(y[:, 0], K.patches.alpha[:, None] * y[:, 1], rtol=1e-6)
    # <K x, z> = <x, K^T z>
    z = rng.random(6 * n).astype(np.float32)
    assert float(z @ K.matvec(x.ravel())) == pytest.approx(float(K.rmatvec(z) @ x.ravel()), rel=1e-4)
    many = rng.random((6 * n, 5))
    assert np.allclose(K @ many, np.column_stack([K @ many[:, k] for k in range(5)]), rtol=1e-5)
    assert np.array_equal(K @ np.asfortranarray(many), K @ many)
    assert np.array_equal(K.matvec(x.astype(np.float64)), y) and K.matvec(x.reshape(-1, 1)).shape == (6 * n, 1)
    bounce = np.asarray(K.matvec(solved.bounces[1].light))
    assert np.array_equal(bounce, solved.bounces[2].light)


def test_arrays_are_views_that_cannot_be_written_to(solved: hl.Solution) -> None:
    K = solved.operator
    for array in [solved.light, solved.bounces[1].light, K.F.data, K.F.indices, K.patches.areas, K.patches.rho]:
        assert not array.flags.owndata
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    begins = lambda array: array.__array_interface__["data"][0]  # noqa: E731
    assert begins(solved.light) == begins(solved.light) and begins(K.F.data) == begins(solved.operator.F.data)
    held = solved.light[3:]
    assert np.isfinite(held).all()


def test_views_outlive_what_they_are_of(box: hl.Scene) -> None:
    light = hl.solve(box, patches=100, rays=16).light
    kept = light.copy()
    for _ in range(5):
        hl.solve(box, patches=100, rays=16, seed=3)
    assert np.array_equal(light, kept)


def test_where_patches_are(solved: hl.Solution) -> None:
    patches = solved.patches
    corners, owner = patches.triangles, patches.triangle_patch
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    # Parts of a divided patch share its triangles.
    whole = np.bincount(patches.whole, patches.areas, len(patches))
    # Corners are rounded to single precision, a share of 1e-7 of the scene's size, before slivers are cut along them.
    assert np.allclose(np.bincount(owner, area, len(patches)), whole, rtol=1e-5, atol=1e-6 * 556**2)
    alone = np.bincount(patches.whole, minlength=len(patches))[patches.whole] == 1
    middle = np.column_stack([np.bincount(owner, area * corners.mean(1)[:, k], len(patches)) for k in range(3)])
    alone &= patches.areas > 1.0
    assert alone.sum() > 300
    assert np.allclose((middle / patches.areas[:, None])[alone], patches.centres[alone], rtol=1e-4, atol=0.05)
    first = np.searchsorted(owner, np.arange(len(patches)))
    assert (np.linalg.norm(patches.centres - corners[first].mean(1), axis=1) < 560).all()
    assert not (np.abs(patches.centres - [278, 274.4, 279.6]) < 0.1).all(1).any()
    assert np.array_equal(patches.on_triangles(patches.rho)[:, 0] > 0, patches.rho[owner, 0] > 0)
    assert np.allclose(np.linalg.norm(patches.normals, axis=1), 1.0, atol=1e-5)
    k = len(patches) // 2
    assert np.array_equal(patches.faces(k), corners[owner == k])
    names = solved.scene.objects
    floor = patches.objects == names.index("floor")
    assert np.allclose(patches.normals[floor], [0, 1, 0], atol=1e-6) and np.allclose(
        patches.centres[floor, 1], 0, atol=1e-3
    )


def test_series_that_diverge_say_so_and_can_be_looked_at() -> None:
    room = hl.load("furnished-room")
    with pytest.raises(hl.Diverges) as caught:
        hl.solve(room, mode="shadowless", patches=300, rays=64)
    error = caught.value
    assert error.radius[0] > 1.0 and error.verdict == "diverges" and 0 < error.alpha_limit < 1
    assert "--" not in str(error)
    terms = hl.solve(room, mode="shadowless", patches=300, rays=64, bounces=8).bounces
    assert len(terms) == 9 and terms.norm[8] > terms.norm[7]
    with pytest.raises(hl.Diverges):
        hl.render(room, mode="shadowless", size=(16, 16), patches=300)


def test_local_light_ends() -> None:
    solution = hl.solve(hl.cornell_box(), mode="local", patches=300, rays=64, bounces=3)
    assert solution.verdict == "ends" and solution.bounces.norm[2] == 0.0


def test_lamps_add_up(lamps: hl.Scene) -> None:
    assert lamps.luminaires == ["left", "right"]
    apart = hl.solve(lamps, per="luminaire", patches=300, rays=64)
    whole = hl.solve(lamps, patches=300, rays=64)
    assert apart.shape == (2, len(whole.patches), 2, 3) == np.asarray(apart).shape
    # Each leaves out 1e-4 of its reflected light at most, in the norm.
    assert np.allclose(apart.mix({}), whole.light, atol=2e-3)
    assert np.allclose(apart.mix({"left": 0.5, "right": [0, 1, 2]}), 0.5 * apart["left"] + [0, 1, 2] * apart["right"])
    picture = hl.render(lamps, size=(24, 18), tolerance=0.1, layers="luminaires")
    assert np.allclose(picture.mix({}), picture, rtol=1e-4, atol=1e-4)
    assert np.allclose(picture.mix({"left": 0}), picture.layers["lamp.right"], rtol=1e-5)
    light = hl.points(lamps, [[1.5, 0.71, 1.5]], [0, 1, 0], tolerance=0.05, per="luminaire")
    assert np.allclose(light.mix({}), light.irradiance, rtol=1e-5)
    assert light.lux[0] == pytest.approx(683 * light.irradiance[0] @ [0.2126, 0.7152, 0.0722])


def test_points_against_a_closed_form() -> None:
    # Below a sky of radiance 1 alone the irradiance is pi.
    ground = hl.Scene([[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]], [[0, 1, 2, 3]], [hl.Material("ground", 0.0)], sky=1)
    light = hl.points(ground, [[0.5, 0.5, 0.5], [0.2, 1e-3, 0.3]], [0, 1, 0], tolerance=0.01)
    assert np.abs(light.irradiance - math.pi).max() <= 4 * light.error.max() + 1e-5
    assert np.allclose(light.bounces.sum(0), light.irradiance, rtol=1e-6)
    assert not light.is_inside.any() and light.met == 1.0
    assert list(light.to_pandas().columns[:3]) == ["x", "y", "z"]


def test_factors_against_closed_forms() -> None:
    # Unit squares at distance 1: 0.19982490; closed boxes have rows of sum 1.
    lower = [[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]]
    upper = [[0, 1, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1]]
    pair = hl.Scene(
        lower + upper, [[0, 1, 2, 3], [4, 5, 6, 7]], [hl.Material("m")], objects=["low", "high"], face_object=[0, 1]
    )
    found = hl.factors(pair, tolerance=1e-6)
    assert found.names == ["low", "high"] and (found.sky == 0.0).all() and (found.sky_error == 0.0).all()
    assert np.allclose(found.closure, 1 - 0.19982490, atol=1e-6)
    assert found.matrix[0, 1] == pytest.approx(0.19982490, abs=1e-7)
    assert found.matrix[1, 0] == pytest.approx(0.19982490, abs=1e-7)
    assert found.how[0, 1] == "closed-form" and found.to_pandas().loc["low", "high"] == found.matrix[0, 1]
    under = hl.factors(pair.with_sky(1.0), tolerance=1e-3)
    assert np.abs(under.closure).max() < 5e-3 and np.allclose(under.sky, 1 - 0.19982490, atol=5e-3)
    # Frames have the same columns with a sky and without, and each row sums to 1.
    for one in (found, under):
        frame = one.to_pandas()
        assert list(frame.columns) == ["low", "high", "sky", "closure"] and "closure" in one._repr_html_()
        assert np.allclose(frame.sum(axis=1), 1.0) and np.array_equal(frame["closure"], one.closure)
    spheres = hl.factors(hl.load("concentric-spheres"), tolerance=1e-3)
    assert np.abs(spheres.closure).max() <= 4 * np.sqrt((spheres.standard_error**2).sum(1)).max() + 1e-3
    between = hl.patch_factors(pair.with_sky(1.0), patches=50, rays=4096)
    assert between.names == ["low", "high"] and between.matrix.shape == (len(between), len(between))
    rows = np.asarray(between.matrix.sum(1)).ravel() + between.sky
    assert np.allclose(rows, 1.0 - between.closure, atol=1e-5) and np.allclose(rows, 1.0, atol=1e-5)
    # N rays know a factor F to 1/sqrt(N F), and a residual is the difference of two. Were what goes to the sky counted
    # as lost, it would be above 1.
    factor = between.matrix.data.mean()
    assert between.residual < 1.2 * np.sqrt(2 / (4096 * factor)) < 0.5 and np.isfinite(between.centres).all()
    assert (hl.patch_factors(pair, patches=50, rays=64).sky == 0.0).all()
    between = hl.patch_factors(hl.cornell_box(), patches=300, rays=64)
    assert np.allclose(np.asarray(between.matrix.sum(1)).ravel(), 1 - between.closure, atol=1e-5)
    assert len(between) == between.matrix.shape[0] and between.residual < 1.0


def test_closure_means_one_thing(box: hl.Scene, solved: hl.Solution) -> None:
    # What rows are short of 1, of the same F by both ways.
    between = hl.patch_factors(box, patches=300, rays=64)
    own = solved.patches.rho.max(axis=1) > 0
    short = 1.0 - np.asarray(between.matrix.sum(axis=1)).ravel()[own]
    assert np.allclose(between.closure[own], short, atol=1e-6)
    mean = np.average(short, weights=solved.patches.areas[own])
    assert solved.closure == pytest.approx((mean, short.min(), short.max()), abs=1e-6) and mean > 0.1


def test_a_map_has_the_radius_of_its_corners(box: hl.Scene) -> None:
    mapped = hl.stability_map(box, grid=3, patches=300, rays=64)
    assert mapped.lower.shape == (3, 3) and (mapped.lower <= mapped.upper).all()
    # Axis 0 is tau, axis 1 alpha: K is 0 at alpha 0, and proportional to alpha at every tau.
    assert (mapped.lower[:, 0] == 0).all() and list(mapped.alpha) == [0, 0.5, 1] and mapped.tau[0] == 0
    assert np.allclose(mapped.upper[:, 2], 2 * mapped.upper[:, 1]) and (np.diff(mapped.upper[:, 2]) > 0).all()
    lower, upper = hl.solve(box, mode="global", patches=300, rays=64).radius
    # Both enclose the radius of K of one F.
    assert mapped.lower[0, 2] <= upper and lower <= mapped.upper[0, 2]


def test_pictures_of_terms_add_up(solved: hl.Solution) -> None:
    terms = solved.pictures(size=(16, 16), samples=16)
    assert terms.shape == (len(solved.bounces), 16, 16, 3)
    whole = solved.picture(size=(16, 16), samples=16)
    assert np.allclose(terms.sum(0), whole, rtol=1e-2, atol=1e-3 * whole.max())


def test_a_folder_of_something_else_is_refused(tmp_path: Path, solved: hl.Solution) -> None:
    with pytest.raises(hl.FolderError, match="meta.json"):
        hl.open(tmp_path)
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(hl.FolderError):
        solved.save(tmp_path)
    assert (tmp_path / "notes.txt").read_text() == "mine"
    solved.save(tmp_path / "kept", also=["ply", "mtx"])
    solved.save(tmp_path / "kept")
    terms = tmp_path / "kept" / "F.npz"
    terms.write_bytes(terms.read_bytes()[:-1])
    with pytest.raises(hl.FolderError, match="F.npz"):
        hl.open(tmp_path / "kept")
