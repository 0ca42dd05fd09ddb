"""Wrong arguments: each a Python exception that says what was expected, and nothing else on the screen."""

from __future__ import annotations

import itertools
import math
import pickle
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import halflight as hl

hypothesis = pytest.importorskip("hypothesis")
from hypothesis import given, settings  # noqa: E402
from hypothesis import strategies as st  # noqa: E402

NAN, INF = math.nan, math.inf
SQUARE = [[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]]
FACE = [[0, 1, 2, 3]]
GREY = [hl.Material("grey")]

#: Wrong values of each kind of argument.
WRONG: dict[str, list[Any]] = {
    "fraction": [-0.1, 1.1, NAN, INF, -INF, "1", None.__class__, [0.5], 1e300, 1j, True],
    "tolerance": [0, -1, 2, NAN, INF, "small", [0.1], {}, b"1", False],
    "count": [0, -1, 10**9, 2**70, 1.5, NAN, "many", [5], 1e3, True, {}],
    "seed": [-1, 2**32, 0.5, "x", NAN, [1]],
    "memory": [0, -1, NAN, INF, "much", [1]],
    "time": [0, -1, NAN, INF, "long", [1]],
    "size": [(0, 1), (1, 0), (-1, 5), (5,), (1, 2, 3), 5, "ab", None, (1.5, 2), (NAN, 1), (2**40, 1), {}],
    "mode": ["Global", "", 1, ["global"], b"local", NAN],
    "progress": [1, "yes", [], 0.5],
    "path": [3, 1.5, [], "", "a\0b", {}],
    "flag": [1, 0, "yes", None, []],
    "scene": [None, "cornell-box", 3, {}, np.zeros(3)],
}

#: What each function takes, by the kind of its arguments.
TAKES: dict[Callable[..., Any], dict[str, str]] = {
    hl.render: {
        "mode": "mode",
        "alpha": "fraction",
        "tau": "fraction",
        "size": "size",
        "tolerance": "tolerance",
        "time": "time",
        "patches": "count",
        "rays": "count",
        "samples": "count",
        "seed": "seed",
        "memory": "memory",
        "progress": "progress",
    },
    hl.trace: {
        "mode": "mode",
        "alpha": "fraction",
        "size": "size",
        "samples": "seed",
        "time": "time",
        "next_event": "flag",
        "seed": "seed",
        "memory": "memory",
        "progress": "progress",
    },
    hl.solve: {
        "mode": "mode",
        "alpha": "fraction",
        "tau": "fraction",
        "patches": "count",
        "rays": "count",
        "bounces": "count",
        "truncation": "tolerance",
        "per": "mode",
        "seed": "seed",
        "memory": "memory",
        "progress": "progress",
    },
    hl.bounces: {"count": "count", "tolerance": "tolerance", "time": "time", "per": "mode", "seed": "seed"},
    hl.factors: {"tolerance": "tolerance", "tau": "fraction", "seed": "seed", "progress": "progress"},
    hl.patch_factors: {"patches": "count", "rays": "count", "tau": "fraction", "seed": "seed", "memory": "memory"},
    hl.stability_map: {"grid": "count", "patches": "count", "rays": "count", "seed": "seed", "memory": "memory"},
}

CASES = [
    pytest.param(function, name, value, id=f"{function.__name__}-{name}-{k}")
    for function, takes in TAKES.items()
    for name, kind in takes.items()
    for k, value in enumerate(WRONG[kind])
] + [
    pytest.param(function, "scene", value, id=f"{function.__name__}-scene-{k}")
    for function in TAKES
    for k, value in enumerate(WRONG["scene"])
]


def refused(call: Callable[[], object], words: str, capfd: pytest.CaptureFixture[str] | None = None) -> None:
    with pytest.raises((TypeError, ValueError, KeyError, OSError, hl.HalflightError)) as caught:
        call()
    message = str(caught.value)
    assert words in message and "panick" not in message and len(message) > 10, message
    if capfd is not None:
        out = capfd.readouterr()
        assert out.out == "" and out.err == "", out


@pytest.mark.parametrize("function, name, value", CASES)
def test_a_wrong_argument_is_named(
    function: Callable[..., Any], name: str, value: Any, box: hl.Scene, capfd: pytest.CaptureFixture[str]
) -> None:
    # One pixel and few patches, should anything be taken after all.
    small = {"patches": 10, "rays": 16} if "patches" in TAKES[function] else {}
    if name in ("tolerance", "time") and function is hl.render:
        small = {}
    named = {**small, name: value}
    if name == "scene":
        scene = named.pop("scene")
        refused(lambda: function(scene, **named), "scene must be a halflight.Scene", capfd)
    else:
        refused(lambda: function(box, **named), name, capfd)


def test_there_are_many_of_them() -> None:
    assert len(CASES) >= 200


@pytest.mark.parametrize(
    "words, make",
    [
        ("vertices", lambda: hl.Scene([[0, 0]], FACE, GREY)),
        ("(n, 3)", lambda: hl.Scene(np.zeros((4, 3, 1)), FACE, GREY)),
        ("vertices", lambda: hl.Scene("square", FACE, GREY)),
        ("vertices[0, 1]", lambda: hl.Scene([[0, NAN, 0], *SQUARE[1:]], FACE, GREY)),
        ("finite", lambda: hl.Scene([[0, INF, 0], *SQUARE[1:]], FACE, GREY)),
        ("vertices", lambda: hl.Scene(np.array(SQUARE, dtype=complex), FACE, GREY)),
        ("vertices", lambda: hl.Scene(np.array(SQUARE, dtype=object), FACE, GREY)),
        ("faces", lambda: hl.Scene(SQUARE, [[0, 1, 2, 4]], GREY)),
        ("faces", lambda: hl.Scene(SQUARE, [[0, 1, 2, -1]], GREY)),
        ("faces", lambda: hl.Scene(SQUARE, [[0, 1]], GREY)),
        ("faces", lambda: hl.Scene(SQUARE, [[0, 1, 2], [0, 1]], GREY)),
        ("faces", lambda: hl.Scene(SQUARE, [], GREY)),
        ("faces", lambda: hl.Scene(SQUARE, [[0.5, 1, 2]], GREY)),
        ("faces", lambda: hl.Scene(SQUARE, 5, GREY)),
        ("faces", lambda: hl.Scene(SQUARE, [[[0, 1, 2]]], GREY)),
        ("faces", lambda: hl.Scene(SQUARE, [["a", "b", "c"]], GREY)),
        ("materials", lambda: hl.Scene(SQUARE, FACE, [])),
        ("Material", lambda: hl.Scene(SQUARE, FACE, ["grey"])),
        ("materials", lambda: hl.Scene(SQUARE, FACE, 3)),
        ("face_material", lambda: hl.Scene(SQUARE, FACE, GREY, [1])),
        ("face_material", lambda: hl.Scene(SQUARE, FACE, GREY, [0, 0])),
        ("face_object", lambda: hl.Scene(SQUARE, FACE, GREY, face_object=[7])),
        ("objects", lambda: hl.Scene(SQUARE, FACE, GREY, objects=[3])),
        ("objects", lambda: hl.Scene(SQUARE, FACE, GREY, objects="floor")),
        ("objects", lambda: hl.Scene(SQUARE, FACE, GREY, objects=[], face_object=[0])),
        ("Camera", lambda: hl.Scene(SQUARE, FACE, GREY, camera=(0, 1, 0))),
        ("sky", lambda: hl.Scene(SQUARE, FACE, GREY, sky=-1)),
        ("sky", lambda: hl.Scene(SQUARE, FACE, GREY, sky=[1, 2])),
        ("name", lambda: hl.Scene(SQUARE, FACE, GREY, name=3)),
        ("area", lambda: hl.Scene([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], GREY)),
        ("rho", lambda: hl.Material("m", 1.5)),
        ("rho", lambda: hl.Material("m", [0.1, 0.2])),
        ("rho", lambda: hl.Material("m", "red")),
        ("emission", lambda: hl.Material("m", emission=-1)),
        ("emission", lambda: hl.Material("m", emission=NAN)),
        ("emission", lambda: hl.Material("m", emission=1e300)),
        ("alpha", lambda: hl.Material("m", alpha=2)),
        ("two_sided", lambda: hl.Material("m", two_sided=1)),
        ("name", lambda: hl.Material(None)),
        ("position", lambda: hl.Camera([0, 0], [1, 1, 1])),
        ("vertical_fov", lambda: hl.Camera([0, 0, 0], [1, 1, 1], vertical_fov=0)),
        ("vertical_fov", lambda: hl.Camera([0, 0, 0], [1, 1, 1], vertical_fov=181)),
        ("target", lambda: hl.Camera([0, 0, 0], [NAN, 1, 1])),
        ("position", lambda: hl.cornell_box().with_camera(position=[1, 1, 1], target=[1, 1, 1])),
        ("up", lambda: hl.cornell_box().with_camera(up=[0, 0, 1])),
        ("180", lambda: hl.cornell_box().with_camera(vertical_fov=180)),
        ("camera", lambda: hl.cornell_box().with_camera("upstairs")),
        ("camera", lambda: hl.cornell_box().with_camera(3)),
        ("there is no material", lambda: hl.cornell_box().with_material("gold", rho=0.5)),
        ("rho", lambda: hl.cornell_box().with_material("white", rho=2)),
        ("up", lambda: hl.cornell_box().with_sky(1, up=[0, 0, 0])),
        ("145", lambda: hl.cornell_box().with_sky_patches([1] * 145)),
        ("radiance", lambda: hl.cornell_box().with_sky_patches([-1] * 146)),
        ("north", lambda: hl.cornell_box().with_sky_patches([1] * 146, north=[0, 1, 0])),
        ("file", lambda: hl.load(3)),
        ("no scene named", lambda: hl.load("nothing.obj")),
        ("neither", lambda: hl.load(Path(__file__))),
        ("file", lambda: hl.load(sys.stdin)),
        ("light", lambda: hl.load("cornell-box", light="sun")),
        ("reflectance", lambda: hl.load("cornell-box", reflectance=2)),
        ("no camera", lambda: hl.load("cornell-box", camera="left")),
        ("two_sided", lambda: hl.load("cornell-box", two_sided="no")),
        ("xyz", lambda: hl.points(hl.cornell_box(), [1, 2, 3], [0, 1, 0])),
        ("xyz", lambda: hl.points(hl.cornell_box(), np.zeros((0, 3)), [0, 1, 0])),
        ("xyz", lambda: hl.points(hl.cornell_box(), [[1, 2, NAN]], [0, 1, 0])),
        ("xyz", lambda: hl.points(hl.cornell_box(), [[1, 2, 1e200]], [0, 1, 0])),
        ("normals", lambda: hl.points(hl.cornell_box(), [[1, 2, 3]], [0, 0, 0])),
        ("normals", lambda: hl.points(hl.cornell_box(), [[1, 2, 3]], [[0, 1, 0]] * 2)),
        ("normals", lambda: hl.points(hl.cornell_box(), [[1, 2, 3]], [0, 1])),
        ("normals", lambda: hl.points(hl.cornell_box(), [[1, 2, 3]], None)),
        ("per", lambda: hl.points(hl.cornell_box(), [[1, 2, 3]], [0, 1, 0], per="lamp")),
        ("emits", lambda: hl.points(hl.Scene(SQUARE, FACE, GREY), [[1, 2, 3]], [0, 1, 0])),
        ("emits", lambda: hl.render(hl.Scene(SQUARE, FACE, GREY))),
        ("emits", lambda: hl.trace(hl.Scene(SQUARE, FACE, GREY))),
        ("emits", lambda: hl.bounces(hl.Scene(SQUARE, FACE, GREY))),
        ("mode or alpha", lambda: hl.render(hl.cornell_box(), mode="global", alpha=0.5)),
        ("not both", lambda: hl.render(hl.cornell_box(), tolerance=0.1, patches=100)),
        ("not both", lambda: hl.render(hl.cornell_box(), time=1, samples=100)),
        ("layers", lambda: hl.render(hl.cornell_box(), layers="lamps")),
        ("layers", lambda: hl.render(hl.cornell_box(), layers=[3])),
        ("layers", lambda: hl.render(hl.cornell_box(), layers=3)),
        ("bounces", lambda: hl.solve(hl.cornell_box(), per="luminaire", bounces=3)),
        ("max_bounces", lambda: hl.trace(hl.cornell_box(), max_bounces=-1)),
        ("meta.json", lambda: hl.open("nowhere")),
        ("folder", lambda: hl.open(5)),
        ("Solution", lambda: hl.plot_bounces(3)),
        ("solution", lambda: hl.plot_bounces()),
        ("StabilityMap", lambda: hl.plot_map(3)),
        ("Solution", lambda: hl.to_pyvista("x")),
        ("nothing.exr", lambda: hl.read_picture("nothing.exr")),
        ("picture", lambda: hl.save_picture("a.exr", np.zeros((3, 3)))),
        ("picture", lambda: hl.save_picture("a.exr", [[["a", "b", "c"]]])),
        (".gif", lambda: hl.save_picture("a.gif", np.zeros((3, 3, 3)))),
        ("pixels", lambda: hl.save_picture("a.png", np.zeros((0, 3, 3)))),
        ("exposure", lambda: hl.save_picture("a.png", np.zeros((3, 3, 3)), exposure=NAN)),
        ("unexpected keyword", lambda: hl.render(hl.cornell_box(), tolerence=0.1)),
        ("missing", lambda: hl.render()),
    ],
)
def test_what_is_wrong_is_said(
    words: str,
    make: Callable[[], object],
    capfd: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    refused(make, words, capfd)
    assert list(tmp_path.iterdir()) == []


def test_results_refuse_wrong_arguments_too(
    solved: hl.Solution, box: hl.Scene, lamps: hl.Scene, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    K, n = solved.operator, len(solved.patches)
    picture = hl.render(box, size=(8, 8), tolerance=0.5)
    apart = hl.solve(lamps, per="luminaire", patches=50, rays=16)
    capfd.readouterr()
    calls: list[tuple[str, Callable[[], object]]] = [
        ("x must be", lambda: K.matvec(np.zeros(5))),
        ("x must be", lambda: K.matvec(np.zeros((6 * n, 2)))),
        ("x must be", lambda: K.matvec("x")),
        ("x must be", lambda: K.matvec(np.zeros(6 * n, complex))),
        ("y must be", lambda: K.rmatvec(None)),
        ("x must be", lambda: K.matmat(np.zeros(6 * n))),
        ("x must be", lambda: K.matmat(np.zeros((5, 5)))),
        ("x must be", lambda: K @ np.zeros((2, 2, 2, 2))),
        ("channel", lambda: K.matrix(3)),
        ("patch", lambda: solved.patches.faces(n)),
        ("patch", lambda: solved.patches.faces(-1)),
        ("values", lambda: solved.patches.on_triangles(np.zeros(3))),
        ("count", lambda: solved.pictures(10**6)),
        ("size", lambda: solved.picture(size=(0, 0))),
        ("samples", lambda: solved.picture(size=(4, 4), samples=0)),
        ("tolerance", lambda: solved.points([[1, 2, 3]], [0, 1, 0], tolerance=0)),
        ("also", lambda: solved.save(tmp_path / "a", also=["obj"])),
        ("folder", lambda: solved.save(3)),
        ("file", lambda: picture.save(3)),
        (".jpg", lambda: picture.save(tmp_path / "a.jpg")),
        ("no-such", lambda: picture.save(tmp_path / "no-such" / "a.png")),
        ("exposure", lambda: picture.save(tmp_path / "a.png", exposure="bright")),
        ("apart", lambda: picture.mix({"light": 0.5})),
        ("luminaire", lambda: apart.mix({"desk": 0.5})),
        ("factor", lambda: apart.mix({"left": -1})),
        ("mapping", lambda: apart.mix([0.5])),
        ("luminaire", lambda: apart["desk"]),
        ("apart", lambda: hl.points(box, [[100, 50, 100]], [0, 1, 0], tolerance=0.5).mix({"light": 1})),
    ]
    for words, call in calls:
        refused(call, words, capfd)
    with pytest.raises(IndexError, match="bounces 0 to"):
        solved.bounces[1000]
    with pytest.raises(IndexError):
        solved.bounces[-1000]
    assert list(tmp_path.iterdir()) == []


def test_a_mistake_in_a_file_has_its_line(tmp_path: Path) -> None:
    (tmp_path / "room.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 x 1\nf 1 2 3\n")
    with pytest.raises(hl.SceneError) as caught:
        hl.load(tmp_path / "room.obj")
    assert caught.value.line == 3 and caught.value.file is not None and caught.value.file.endswith("room.obj")
    again = pickle.loads(pickle.dumps(caught.value))
    assert type(again) is hl.SceneError and str(again) == str(caught.value) and again.line == 3
    (tmp_path / "odd.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 2 3\ncurv 1\n")
    with pytest.warns(hl.SceneWarning):
        hl.load(tmp_path / "odd.obj")


def test_too_large_does_not_fit() -> None:
    with pytest.raises(hl.DoesNotFit) as caught:
        hl.solve(hl.cornell_box(), patches=100_000, rays=256, memory=0.1)
    assert caught.value.fitting > 0 and caught.value.bytes > caught.value.limit
    assert isinstance(caught.value, MemoryError) and "patches=" in str(caught.value)
    with pytest.raises(hl.DoesNotFit):
        hl.render(hl.cornell_box(), size=(100_000, 100_000), memory=1)


def test_a_tolerance_that_is_not_met_is_a_warning(box: hl.Scene) -> None:
    with pytest.warns(hl.ToleranceWarning, match="asked for|not known"):
        hl.render(box, size=(16, 16), tolerance=1e-5, time=0.2)


anything = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=5),
    st.binary(max_size=5),
    st.lists(st.one_of(st.floats(), st.integers(-5, 10), st.text(max_size=2)), max_size=4),
    st.lists(st.lists(st.integers(-2, 6), max_size=4), max_size=3),
    st.just(np.zeros((2, 3))),
    st.just(np.array([[NAN, 1, 2]])),
    st.just(object()),
    st.just({}),
)
EXPECTED = (TypeError, ValueError, KeyError, OSError, hl.HalflightError)


@settings(max_examples=150, deadline=None)
@given(anything, anything, anything, anything)
def test_scenes_of_anything(vertices: Any, faces: Any, rho: Any, sky: Any) -> None:
    try:
        scene = hl.Scene(vertices, faces, [hl.Material("m", rho)], sky=sky)
    except EXPECTED as error:
        assert "panick" not in str(error)
    else:
        assert scene.triangles > 0


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(list(TAKES)), st.data())
def test_functions_of_anything(function: Callable[..., Any], data: Any) -> None:
    takes = TAKES[function]
    names = data.draw(st.lists(st.sampled_from(sorted(takes)), min_size=1, max_size=3, unique=True))
    named = {name: data.draw(anything, label=name) for name in names}
    # What is right must be cheap.
    if any(isinstance(value, int) and abs(value) > 64 for value in named.values()):
        return
    quick = {"patches": 10, "rays": 16} if "patches" in takes else {"tolerance": 0.5}
    if function is hl.trace:
        quick = {"samples": 1}
    if function is hl.render and {"tolerance", "time"} & set(named):
        quick = {}
    if "size" in takes:
        quick["size"] = (2, 2)
    try:
        function(hl.cornell_box(), **{**quick, **named})
    except EXPECTED as error:
        assert "panick" not in str(error)


@settings(max_examples=100, deadline=None)
@given(
    st.lists(st.tuples(*[st.floats(-1e30, 1e30)] * 3), min_size=3, max_size=8),
    st.lists(st.lists(st.integers(0, 7), min_size=3, max_size=5), min_size=1, max_size=6),
    st.floats(0, 1),
    st.floats(0, 1e6),
)
def test_any_polygons_can_be_solved_or_are_refused(vertices: Any, faces: Any, rho: float, emission: float) -> None:
    try:
        scene = hl.Scene(vertices, faces, [hl.Material("m", rho, emission, two_sided=True)])
        solution = hl.solve(scene, patches=20, rays=16, bounces=2)
    except EXPECTED as error:
        assert "panick" not in str(error)
    else:
        assert np.isfinite(solution.light).all()


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_products_of_any_layout(solved: hl.Solution, data: Any) -> None:
    K = solved.operator
    n = K.shape[0]
    kind = data.draw(st.sampled_from(["f2", "f4", "f8", ">f4", ">f8", "i4", "u1"]))
    shape = data.draw(st.sampled_from([(n,), (n, 1), (n // 6, 2, 3), (n, 3)]))
    values = (np.arange(math.prod(shape)) % 7).astype(kind).reshape(shape)
    layout = data.draw(st.sampled_from(["C", "F", "strided", "reversed"]))
    given_ = {
        "C": values,
        "F": np.asfortranarray(values),
        "strided": np.repeat(values, 2, axis=-1)[..., ::2],
        "reversed": values[::-1][::-1],
    }[layout]
    wanted = K @ np.ascontiguousarray(values, np.float32)
    assert np.array_equal(K @ given_, wanted)


def test_the_cases_are_different() -> None:
    assert len({case.id for case in CASES}) == len(CASES)
    assert all(kind in WRONG for kind in itertools.chain.from_iterable(t.values() for t in TAKES.values()))


def test_a_room_wound_outwards_is_turned() -> None:
    file = Path(__file__).resolve().parents[2] / "tests" / "data" / "welcome" / "room.obj"
    with pytest.warns(hl.SceneWarning, match="turned inside out"):
        turned = hl.load(file)
    with pytest.warns(hl.SceneWarning) as said:
        kept = hl.load(file, as_modelled=True)
    assert not any("inside out" in str(warning.message) for warning in said)
    assert turned.vertices.shape == kept.vertices.shape
    with pytest.raises(TypeError):
        hl.load(file, as_modelled="yes")  # type: ignore[arg-type]
