"""Scenes of named objects, meshes of others, textures and lights without area, against closed forms."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import halflight as hl

FLOOR = hl.quad([-2, 0, -2], [0, 0, 4], [4, 0, 0])


def floor(lights: list[Any], unit: Any = "m", scale: float = 1.0) -> hl.Scene:
    """A black floor, 4 m wide, that faces up."""
    mesh = hl.Mesh(scale * FLOOR.vertices, FLOOR.faces)
    return hl.Scene.from_objects({"floor": (mesh, hl.Material("black", 0.0))}, lights=lights, unit=unit)


def area(mesh: hl.Mesh) -> float:
    corners = mesh.vertices[np.asarray(mesh.faces)]
    return float(np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]), axis=1).sum())


def test_boxes_and_quads_face_as_they_say() -> None:
    lo, hi = np.array([1.0, 2.0, 3.0]), np.array([2.0, 4.0, 6.0])
    for inward in (False, True):
        box = hl.box(lo, hi, inward=inward)
        corners = box.vertices[box.faces]
        assert corners.shape == (6, 4, 3) and area(box) == pytest.approx(2 * (1 * 2 + 2 * 3 + 3 * 1))
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0])
        outwards = (normals * (corners.mean(axis=1) - (lo + hi) / 2)).sum(axis=1)
        assert (outwards < 0).all() if inward else (outwards > 0).all()
        # Each side lies where its name says, and its texture is upright: u × v is the normal.
        for k, side in enumerate(["-x", "+x", "-y", "+y", "-z", "+z"]):
            axis, end = "xyz".index(side[1]), hi if side[0] == "+" else lo
            one = hl.box(lo, hi, inward=inward, sides=side)
            assert np.array_equal(one.vertices, corners[k]) and (corners[k][:, axis] == end[axis]).all()
            assert one.uv.tolist() == [[0, 0], [1, 0], [1, 1], [0, 1]]
    quad = hl.quad([1, 0, 0], [0, 2, 0], [0, 0, 3])
    assert quad.vertices.tolist() == [[1, 0, 0], [1, 2, 0], [1, 2, 3], [1, 0, 3]] and area(quad) == 6.0


def test_named_objects_are_the_scene_of_the_same_arrays() -> None:
    wall, wood = hl.Material("wall", 0.6), hl.Material("wood", [0.5, 0.4, 0.3])
    lamp = hl.Material("lamp", 0.0, emission=10.0)
    objects: dict[str, Any] = {
        "walls": (hl.box([0, 0, 0], [4, 2.5, 3], inward=True), wall),
        "lamp": (hl.box([1, 2.3, 1], [2, 2.4, 2], sides="-y"), lamp),
        "table": ([hl.box([1, 0.7, 1], [2, 0.8, 2]), hl.box([1.4, 0, 1.4], [1.6, 0.7, 1.6])], wood),
        "shelf": (hl.box([3, 1, 1], [4, 1.1, 2]).vertices, hl.box([3, 1, 1], [4, 1.1, 2]).faces, wood),
    }
    made = hl.Scene.from_objects(objects, sky=1.0, name="room")
    meshes = [hl._meshes.taken(own[0]) if len(own) == 2 else hl.Mesh(own[0], own[1]) for own in objects.values()]
    whole = hl._meshes.joined(meshes)
    count = [len(mesh.faces) for mesh in meshes]
    by_hand = hl.Scene(
        whole.vertices,
        whole.faces,
        [wall, lamp, wood],
        np.repeat([0, 1, 2, 2], count),
        objects=list(objects),
        face_object=np.repeat(range(4), count),
        sky=1.0,
        name="room",
    )
    assert made.objects == list(objects) and made.luminaires[0] == "lamp" and made.materials == by_hand.materials
    assert made._held.to_bytes() == by_hand._held.to_bytes()
    assert count == [6, 1, 12, 6] and made.triangles == 50


def test_a_box_in_a_box_has_the_factors_of_its_closed_form() -> None:
    # Everything that leaves the inner box meets the outer one, so by reciprocity F_outer,inner = A_inner / A_outer.
    scene = hl.Scene.from_objects(
        {"inner": hl.box([1, 1, 1], [2, 2, 2]), "outer": hl.box([0] * 3, [3] * 3, inward=True)}
    )
    found = hl.factors(scene, tolerance=1e-3)
    assert found.names == ["inner", "outer"]
    assert found.matrix[0] == pytest.approx([0.0, 1.0], abs=2e-3)
    assert found.matrix[1, 0] == pytest.approx(6 / 54, abs=2e-3)


class OfPyVista:
    """What pyvista's PolyData has: points, and polygons with their lengths before them."""

    def __init__(self, points: Any, faces: Any) -> None:
        self.points, self.faces, self.n_cells = points, faces, 1
        self.active_texture_coordinates = None


def test_meshes_of_others_are_taken_as_they_are() -> None:
    trimesh = pytest.importorskip("trimesh")
    cube = trimesh.creation.box(extents=[1, 1, 1])
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.4)
    scene = hl.Scene.from_objects(
        {"ball": (ball, hl.Material("white", 0.8)), "cube": [cube, hl.box([2, 0, 0], [3, 1, 1])]}
    )
    assert scene.triangles == len(ball.faces) + 12 + 12 and scene.objects == ["ball", "cube"]
    found = hl.factors(hl.Scene.from_objects({"cube": cube, "far": hl.box([5] * 3, [6] * 3)}), tolerance=1e-3)
    assert found.areas == pytest.approx([6.0, 6.0])
    # Triangles and a quad: polygons of several lengths in one list.
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]]
    mixed = OfPyVista(points, [4, 0, 1, 2, 3, 3, 1, 4, 2])
    even = OfPyVista(points, [3, 0, 1, 2, 3, 1, 4, 2])
    assert hl.Scene.from_objects({"m": mixed}).triangles == 3 and hl.Scene.from_objects({"m": even}).triangles == 2


def test_a_mesh_of_pyvista_keeps_its_area() -> None:
    pyvista = pytest.importorskip("pyvista")
    for mesh in (pyvista.Box(), pyvista.ImageData(dimensions=(3, 3, 3)), pyvista.Sphere()):
        scene = hl.Scene.from_objects({"own": mesh})
        corners = scene.vertices[scene.faces]
        sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        surface = mesh.extract_surface() if not hasattr(mesh, "faces") else mesh
        assert 0.5 * np.linalg.norm(sides, axis=1).sum() == pytest.approx(surface.area, rel=1e-5)


def test_lights_without_area_have_the_irradiance_of_their_formulas() -> None:
    at = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.5]]
    d = np.array([2.0, math.sqrt(4 + 1 + 0.25)])
    cosine = 2.0 / d

    def measured(light: Any, unit: Any = "m", scale: float = 1.0) -> Any:
        found = hl.points(floor([light], unit, scale), scale * np.array(at), [0, 1, 0], mode="local", tolerance=1e-3)
        return found.irradiance

    point = hl.PointLight([0, 2, 0], [10, 20, 0])
    expected = np.outer(cosine / d**2, [10, 20, 0])
    assert np.allclose(measured(point), expected, rtol=1e-5)
    # The same lamp in centimetres and in feet: 1/d² is in metres.
    assert np.allclose(measured(hl.PointLight([0, 200, 0], [10, 20, 0]), "cm", 100.0), expected, rtol=1e-5)
    assert np.allclose(measured(hl.PointLight([0, 2 / 0.3048, 0], [10, 20, 0]), "ft", 1 / 0.3048), expected, rtol=1e-5)
    spot = hl.SpotLight([0, 2, 0], [0, -3, 0], 10.0, cutoff=60.0, exponent=2.0)
    assert np.allclose(measured(spot)[:, 0], 10 * cosine**2 * cosine / d**2, rtol=1e-5)
    narrow = hl.SpotLight([0, 2, 0], [0, -1, 0], 10.0, cutoff=20.0)
    assert np.allclose(measured(narrow)[:, 0], [2.5, 0.0])
    sun = hl.SunLight([3, -4, 0], [100, 50, 25])
    assert np.allclose(measured(sun), [[80, 40, 20]] * 2, rtol=1e-5)


def test_lights_are_luminaires_by_their_names() -> None:
    lights = [hl.PointLight([0, 2, 0], 10, "desk"), hl.SunLight([0, -1, 0], 5), hl.SpotLight([0, 1, 0], [0, -1, 0], 3)]
    scene = floor(lights)
    assert scene.luminaires == ["desk", "light 2", "light 3"]
    found = hl.points(scene, [[0, 0, 0]], [0, 1, 0], mode="local", per="luminaire", tolerance=1e-3)
    assert found.luminaires["desk"][0, 0] == pytest.approx(2.5, rel=1e-4) and found.luminaires["light 2"][
        0, 0
    ] == pytest.approx(5)
    again = pickle.loads(pickle.dumps(scene))
    assert again.luminaires == scene.luminaires


def test_a_texture_lies_on_the_surface_as_it_says() -> None:
    # Row 0 is the upper one: v from 0.5 to 1. The left half is red, u from 0 to 0.5.
    image = np.zeros((2, 2, 3))
    image[0, 0], image[0, 1], image[1, 0], image[1, 1] = [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]
    texture = hl.Texture(image, wrap="clamp", filter="nearest")
    wall = hl.quad([0, 0, 0], [4, 0, 0], [0, 4, 0])
    scene = hl.Scene.from_objects({"wall": (wall, hl.Material("m", 0.5, rho_texture=texture))}, sky=1.0)
    patches = hl.solve(scene, patches=64, rays=16).patches
    own = patches.objects == 0
    u, v = patches.centres[own, 0] / 4, patches.centres[own, 1] / 4
    for right, up, colour in [(0, 1, [1, 0, 0]), (1, 1, [0, 1, 0]), (0, 0, [0, 0, 1]), (1, 0, [1, 1, 1])]:
        inside = (np.abs(u - 0.25 - 0.5 * right) < 0.12) & (np.abs(v - 0.25 - 0.5 * up) < 0.12)
        assert inside.any() and np.allclose(patches.rho[own][inside], 0.5 * np.array(colour), atol=1e-6)
    # What a lit checker sends in the mean is that of its mean reflectance.
    assert np.average(patches.rho[own], axis=0, weights=patches.areas[own]) == pytest.approx([0.25] * 3, rel=1e-3)


def test_a_texture_of_emission_has_the_power_of_its_mean() -> None:
    ramp = np.linspace(0.0, 1.0, 64)[None, :] ** 2
    lamp = hl.Material("lamp", 0.0, emission=[8.0, 4.0, 0.0], emission_texture=ramp)
    scene = hl.Scene.from_objects({"lamp": (hl.quad([0, 0, 0], [3, 0, 0], [0, 2, 0]), lamp)})
    power = hl.solve(scene, patches=200, rays=16).bounces.power[0]
    assert power == pytest.approx(math.pi * 6 * ramp.mean() * np.array([8.0, 4.0, 0.0]), rel=5e-3)
    assert hl.Material("m", rho_texture=ramp) == hl.Material("m", rho_texture=ramp) != hl.Material("m")
    codes = hl.Texture(np.arange(256, dtype=np.uint8).reshape(16, 16)).codes
    assert np.array_equal(codes[..., 0].ravel(), np.arange(256)) and not codes.flags.writeable


def test_textures_of_trimesh_have_its_coordinates() -> None:
    trimesh = pytest.importorskip("trimesh")
    vertices, faces = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    visual = trimesh.visual.TextureVisuals(uv=[[0, 0], [1, 0], [1, 1], [0, 1]])
    mesh = trimesh.Trimesh(vertices, faces, visual=visual, process=False)
    image = hl.Texture([[1.0], [0.0]], wrap="clamp", filter="nearest")
    scene = hl.Scene.from_objects({"sign": (mesh, hl.Material("m", 0.8, rho_texture=image))}, sky=1.0)
    patches = hl.solve(scene, patches=16, rays=16).patches
    own = patches.objects == 0
    up = patches.centres[own, 1]
    assert patches.rho[own][up > 0.8].min() > 0.7 and patches.rho[own][up < 0.2].max() < 0.1


@pytest.mark.parametrize(
    "words, make",
    [
        ("hi[1] must be above lo[1]", lambda: hl.box([0, 0, 0], [1, 0, 1])),
        ("sides must be one of", lambda: hl.box([0, 0, 0], [1, 1, 1], sides="top")),
        ("sides must name one", lambda: hl.box([0, 0, 0], [1, 1, 1], sides=[])),
        ("inward must be True or False", lambda: hl.box([0, 0, 0], [1, 1, 1], inward=1)),  # type: ignore[arg-type]
        ("lie on one line", lambda: hl.quad([0, 0, 0], [1, 1, 0], [2, 2, 0])),
        ("corner must have the shape (3,)", lambda: hl.quad([0, 0], [1, 1, 0], [2, 2, 0])),
        ("faces[0, 2] is 9", lambda: hl.Mesh([[0, 0, 0]] * 3, [[0, 1, 9]])),
        ("uv must have the shape (3, 2)", lambda: hl.Mesh([[0, 0, 0]] * 3, [[0, 1, 2]], [[0, 0]])),
        ("objects must be a mapping", lambda: hl.Scene.from_objects([FLOOR])),  # type: ignore[arg-type]
        ("objects must be a mapping", lambda: hl.Scene.from_objects({})),
        ("objects['a'] must be", lambda: hl.Scene.from_objects({"a": (FLOOR, "white")})),
        ("objects['a']: a mesh must be", lambda: hl.Scene.from_objects({"a": 3})),
        ("objects['a']: faces", lambda: hl.Scene.from_objects({"a": ([[0, 0, 0]], [[0, 1, 2]], hl.Material("m"))})),
        ("must not be empty", lambda: hl.Scene.from_objects({"a": []})),
        ("the name of an object", lambda: hl.Scene.from_objects({3: FLOOR})),  # type: ignore[dict-item]
        (
            "two materials that differ are called 'm'",
            lambda: hl.Scene.from_objects({"a": (FLOOR, hl.Material("m")), "b": (FLOOR, hl.Material("m", 0.1))}),
        ),
        (
            "objects['a'] has a texture",
            lambda: hl.Scene.from_objects(
                {"a": (FLOOR.vertices, FLOOR.faces, hl.Material("m", rho_texture=[[0.0, 1.0]]))}
            ),
        ),
        (
            "uv is needed",
            lambda: hl.Scene(FLOOR.vertices, FLOOR.faces, [hl.Material("m", rho_texture=[[0.0, 1.0]])]),
        ),
        ("lights[0] must be a PointLight or SpotLight or SunLight", lambda: floor([3])),
        ("unit must be one of", lambda: floor([], "yard")),
        ("intensity must be 0 or more", lambda: hl.PointLight([0, 0, 0], -1)),
        ("position must be finite", lambda: hl.PointLight([0, math.nan, 0], 1)),
        ("direction must not be zero", lambda: hl.SunLight([0, 0, 0], 1)),
        ("cutoff must be a number above 0 to 90", lambda: hl.SpotLight([0, 0, 0], [0, 1, 0], 1, cutoff=0)),
        ("exponent must be", lambda: hl.SpotLight([0, 0, 0], [0, 1, 0], 1, exponent=-1)),
        ("name must be a text", lambda: hl.PointLight([0, 0, 0], 1, name=3)),  # type: ignore[arg-type]
        ("image must be (height, width)", lambda: hl.Texture(np.zeros((2, 2, 4)))),
        ("image must be (height, width)", lambda: hl.Texture(np.zeros((2, 2), np.uint16))),
        ("image must be from 0 to 1", lambda: hl.Texture([[0.0, 1.5]])),
        ("image must be finite", lambda: hl.Texture([[0.0, math.nan]])),
        ("1 to 32768 texels", lambda: hl.Texture(np.zeros((0, 2)))),
        ("wrap must be one of", lambda: hl.Texture([[1.0]], wrap="tile")),  # type: ignore[arg-type]
    ],
)
def test_what_is_wrong_is_said(words: str, make: Callable[[], object]) -> None:
    with pytest.raises((TypeError, ValueError)) as caught:
        make()
    assert words in str(caught.value), str(caught.value)
