"""Scenes: read from files, built in, or made from arrays."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, cast

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native, _show
from halflight._errors import SceneWarning, in_python

__all__ = ["Camera", "Material", "Scene", "cornell_box", "load", "scenes"]


@dataclass(frozen=True)
class Material:
    """A diffuse material.

    Parameters
    ----------
    name : str
        What it is called.
    rho : float or (3,) floats
        Reflectance, 0 to 1; one number for all channels, or red, green and blue.
    emission : float or (3,) floats
        Emitted radiance, W/(m² sr).
    alpha, tau : float, optional
        Its own interreflection and transmission, 0 to 1, whatever mode is solved.
    two_sided : bool
        Whether both sides of its faces reflect and emit; the back of a one-sided face is black.
    visible_emission : bool
        Whether the camera sees the emission; a hidden lamp lights the scene and is black itself.

    Raises
    ------
    TypeError, ValueError
        A number that is none, or outside its range.
    """

    name: str
    rho: Any = 0.5
    emission: Any = 0.0
    alpha: float | None = None
    tau: float | None = None
    two_sided: bool = False
    visible_emission: bool = True

    def __post_init__(self) -> None:
        def own(name: str, value: object) -> None:
            object.__setattr__(self, name, value)

        arguments.text("name", self.name)
        own("rho", tuple(arguments.triple("rho", self.rho, 0.0, 1.0)))
        own("emission", tuple(arguments.triple("emission", self.emission, 0.0, 3e38)))
        own("alpha", None if self.alpha is None else arguments.real("alpha", self.alpha, 0.0, 1.0))
        own("tau", None if self.tau is None else arguments.real("tau", self.tau, 0.0, 1.0))
        own("two_sided", arguments.flag("two_sided", self.two_sided))
        own("visible_emission", arguments.flag("visible_emission", self.visible_emission))


@dataclass(frozen=True)
class Camera:
    """A pinhole camera in the units of the scene.

    Parameters
    ----------
    position, target : (3,) floats
        The eye, and a point in the middle of the picture.
    up : (3,) floats
        What is up in the picture; not along the view.
    vertical_fov : float
        Full vertical field of view, degrees, between 0 and 180.
    """

    position: Any
    target: Any
    up: Any = (0.0, 1.0, 0.0)
    vertical_fov: float = 40.0

    def __post_init__(self) -> None:
        for name in ("position", "target", "up"):
            point = arguments.array(name, getattr(self, name), (3,))
            object.__setattr__(self, name, tuple(float(x) for x in point))
        fov = arguments.real("vertical_fov", self.vertical_fov, 0.0, 179.999, open_below=True)
        object.__setattr__(self, "vertical_fov", fov)


class Scene:
    """A checked scene: triangles, materials, lights and a camera. It never changes.

    Made from arrays here, read from files by :func:`load`. Its rays are made ready when something is first solved for
    it, and kept for all that follows.

    Parameters
    ----------
    vertices : (n, 3) floats
        Corner points, in any one unit.
    faces : (m, k) ints, or a sequence of m sequences of ints
        Corners of each polygon, k of 3 or more, counted from 0, counter-clockwise seen from the front.
    materials : sequence of Material
        At least one.
    face_material : (m,) ints, optional
        The material of each face; the first for all where it is left out.
    objects : sequence of str, optional
        Names of objects, by which form factors and luminaires are told apart.
    face_object : (m,) ints, optional
        The object of each face; the first for all where it is left out.
    camera : Camera, optional
        Where pictures are taken from; one that shows all of the scene where it is left out.
    sky : float or (3,) floats, optional
        Radiance of a sky all around, W/(m² sr).
    name : str
        What the scene is called.

    Raises
    ------
    SceneError
        A vertex, face or material that breaks a rule, by its number in ``.item``.
    TypeError, ValueError
        An array of another shape or kind than is wanted.

    Examples
    --------
    >>> import halflight as hl
    >>> room = hl.Scene([[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]], [[0, 3, 2, 1]], [hl.Material("floor")], sky=1)
    >>> room.triangles
    2
    """

    _held: _native.Scene
    #: As it was given, where it was.
    _camera: Camera | None

    def __init__(
        self,
        vertices: npt.ArrayLike,
        faces: npt.ArrayLike | Sequence[Sequence[int]],
        materials: Sequence[Material],
        face_material: npt.ArrayLike | None = None,
        *,
        objects: Sequence[str] | None = None,
        face_object: npt.ArrayLike | None = None,
        camera: Camera | None = None,
        sky: npt.ArrayLike | None = None,
        name: str = "scene",
    ) -> None:
        name = arguments.text("name", name)
        points = arguments.array("vertices", vertices, ("n", 3))
        corners, counts = _polygons(faces, len(points))
        kinds = _list_of("materials", materials, Material)
        names = [name] if objects is None else [arguments.text("objects", one) for one in _sequence("objects", objects)]
        count = len(counts)
        of_material = _given("face_material", face_material, count, len(kinds), "materials")
        of_object = _given("face_object", face_object, count, len(names), "objects")
        made = _native.scene_from_arrays(name, points, corners, counts, of_material, of_object, kinds, names)
        if sky is not None:
            made = _under_sky(made, sky)
        if camera is not None:
            made = _looked_at(made, camera)
        self._held = made
        self._camera = camera
        self._warn()

    @classmethod
    def _of(cls, native: _native.Scene, camera: Camera | None = None) -> Scene:
        scene = cls.__new__(cls)
        scene._held = native
        scene._camera = camera
        return scene

    def _warn(self) -> None:
        for warning in self._held.warnings():
            warnings.warn(in_python(warning), SceneWarning, stacklevel=3)

    # What it holds.

    @property
    def name(self) -> str:
        """The built-in scene's name or the file's stem."""
        return self._held.name

    @property
    def vertices(self) -> npt.NDArray[np.float64]:
        """Corner points in the file's units, (n, 3) float64."""
        return cast("npt.NDArray[np.float64]", self._held.vertices())

    @property
    def faces(self) -> npt.NDArray[np.uint32]:
        """Vertices of each triangle, counter-clockwise seen from the front, (m, 3) uint32."""
        return cast("npt.NDArray[np.uint32]", self._held.faces())

    @property
    def face_material(self) -> npt.NDArray[np.uint32]:
        """The number in ``materials`` of each triangle, (m,) uint32."""
        return cast("npt.NDArray[np.uint32]", self._held.face_material())

    @property
    def face_object(self) -> npt.NDArray[np.uint32]:
        """The number in ``objects`` of each triangle, (m,) uint32."""
        return cast("npt.NDArray[np.uint32]", self._held.face_object())

    @property
    def triangles(self) -> int:
        """Number of triangles."""
        return len(self.face_material)

    @property
    def materials(self) -> list[Material]:
        """What the faces are made of; without textures, which files have and this does not show."""

        def short(x: float) -> float:
            """Single precision as a person writes it: 0.73, not 0.7300000190734863."""
            return float(str(np.float32(x)))

        return [
            Material(
                name,
                tuple(short(x) for x in rho),
                tuple(short(x) for x in emission),
                None if alpha is None else short(alpha),
                None if tau is None else short(tau),
                two_sided,
                seen,
            )
            for name, rho, emission, alpha, tau, two_sided, seen in self._held.materials()
        ]

    @property
    def objects(self) -> list[str]:
        """Names of the objects."""
        return self._held.objects()

    @property
    def luminaires(self) -> list[str]:
        """Names of what emits, by which ``per="luminaire"`` keeps light apart."""
        return self._held.luminaires()

    @property
    def cameras(self) -> list[str]:
        """Names of the cameras that the file brings."""
        return self._held.cameras()

    @property
    def camera(self) -> Camera:
        """Where pictures are taken from."""
        if self._camera is not None:
            return self._camera
        return Camera(*self._held.camera())

    @property
    def warnings(self) -> list[str]:
        """What the reader left out."""
        return self._held.warnings()

    @property
    def transport(self) -> tuple[float, float] | None:
        """(alpha, tau) that the scene file gives, if it gives any."""
        return self._held.transport()

    # Others made from it.

    def with_camera(
        self,
        camera: Camera | str | None = None,
        *,
        position: npt.ArrayLike | None = None,
        target: npt.ArrayLike | None = None,
        up: npt.ArrayLike | None = None,
        vertical_fov: float | None = None,
    ) -> Scene:
        """The same scene seen from elsewhere.

        Parameters
        ----------
        camera : Camera or str, optional
            A camera, or the name of one of ``cameras``; else the present one.
        position, target, up, vertical_fov
            What differs from it.

        Returns
        -------
        Scene
            The scene. What is left out of the camera stays, its target too.
        """
        if isinstance(camera, str):
            seen = Scene._of(self._held.looked_through(camera))
            return seen.with_camera(position=position, target=target, up=up, vertical_fov=vertical_fov)
        if camera is not None and not isinstance(camera, Camera):
            raise TypeError(f"camera must be a Camera or the name of one of the scene's, not {camera!r}")
        given: dict[str, Any] = {"position": position, "target": target, "up": up, "vertical_fov": vertical_fov}
        own = self.camera if camera is None else camera
        seen_by = replace(own, **{k: v for k, v in given.items() if v is not None})
        return Scene._of(_looked_at(self._held, seen_by), seen_by)

    def with_material(
        self,
        name: str,
        *,
        rho: npt.ArrayLike | None = None,
        emission: npt.ArrayLike | None = None,
        alpha: float | None = None,
        tau: float | None = None,
        two_sided: bool | None = None,
    ) -> Scene:
        """The same scene with other numbers of a material; what is left out stays.

        Parameters
        ----------
        name : str
            One of the names in ``materials``.
        rho, emission : float or (3,) floats, optional
            Reflectance, 0 to 1, and emitted radiance, W/(m² sr); factors where the material has textures.
        alpha, tau : float, optional
            Its own, 0 to 1.
        two_sided : bool, optional
            Whether both sides reflect and emit.

        Raises
        ------
        KeyError
            There is no such material.
        """
        name = arguments.text("name", name)
        known = [material.name for material in self.materials]
        if name not in known:
            raise KeyError(f"there is no material {name!r}; the materials are {', '.join(map(repr, known))}")
        return Scene._of(
            self._held.with_material(
                name,
                None if rho is None else arguments.triple("rho", rho, 0.0, 1.0),
                None if emission is None else arguments.triple("emission", emission, 0.0, 3e38),
                None if alpha is None else arguments.real("alpha", alpha, 0.0, 1.0),
                None if tau is None else arguments.real("tau", tau, 0.0, 1.0),
                None if two_sided is None else arguments.flag("two_sided", two_sided),
            ),
            self._camera,
        )

    def with_sky(
        self, radiance: npt.ArrayLike, lower: npt.ArrayLike | None = None, up: npt.ArrayLike = (0.0, 1.0, 0.0)
    ) -> Scene:
        """The same scene under a sky.

        Parameters
        ----------
        radiance : float or (3,) floats
            Radiance from above, W/(m² sr).
        lower : float or (3,) floats, optional
            Radiance from below; that from above where it is left out.
        up : (3,) floats
            What is above.
        """
        return Scene._of(_under_sky(self._held, radiance, lower, up), self._camera)

    # How it is shown, copied and kept.

    def __repr__(self) -> str:
        lights = ", ".join(self.luminaires) or "none"
        return f"<halflight.Scene {self.name}: {self.triangles} triangles, luminaires: {lights}>"

    def _repr_html_(self) -> str:
        return _show.scene(self._held, repr(self).strip("<>"))

    def __reduce__(self) -> tuple[Any, ...]:
        return (_scene_of_bytes, (self._held.to_bytes(), self._camera))

    def __copy__(self) -> Scene:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Scene:
        return self


def _scene_of_bytes(held: bytes, camera: Camera | None) -> Scene:
    return Scene._of(_native.scene_from_bytes(held), camera)


def _sequence(name: str, value: Any) -> list[Any]:
    if isinstance(value, (str, bytes)):
        raise TypeError(f"{name} must be a sequence, not {value!r}")
    try:
        return list(value)
    except TypeError:
        raise TypeError(f"{name} must be a sequence, not {value!r}") from None


def _list_of(name: str, value: Any, kind: type) -> list[Any]:
    found = _sequence(name, value)
    for k, one in enumerate(found):
        if not isinstance(one, kind):
            raise TypeError(f"{name}[{k}] must be a {kind.__name__}, not {one!r}")
    if not found:
        raise ValueError(f"{name} must not be empty")
    return found


def _polygons(faces: Any, vertices: int) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
    """The corners of all polygons one after the other, and how many each has."""
    try:
        table = np.asarray(faces)
    except ValueError:
        table = np.empty(0, dtype=object)
    if table.dtype != object and table.ndim == 2 and table.shape[1] >= 3:
        corners = arguments.indices("faces", table, ("m", "k"), vertices, "vertices")
        return corners.reshape(-1), np.full(len(corners), table.shape[1], dtype=np.uint32)
    rows = [
        arguments.indices(f"faces[{k}]", np.asarray(row), ("k",), vertices, "vertices")
        for k, row in enumerate(_sequence("faces", faces))
    ]
    for k, row in enumerate(rows):
        if len(row) < 3:
            raise ValueError(f"faces[{k}] must have three corners or more, not {len(row)}")
    if not rows:
        raise ValueError("faces must have the shape (m, k), k of 3 or more, and m is 0")
    return np.concatenate(rows), np.array([len(row) for row in rows], dtype=np.uint32)


def _given(name: str, value: Any, count: int, most: int, what: str) -> npt.NDArray[np.uint32]:
    if value is None:
        return np.zeros(count, dtype=np.uint32)
    found = arguments.indices(name, value, ("m",), most, what)
    if len(found) != count:
        raise ValueError(f"{name} must have the shape ({count},), one for each face, not {found.shape}")
    return found


def _under_sky(native: _native.Scene, radiance: Any, lower: Any = None, up: Any = (0.0, 1.0, 0.0)) -> _native.Scene:
    above = arguments.triple("sky", radiance, 0.0, 3e38)
    below = above if lower is None else arguments.triple("lower", lower, 0.0, 3e38)
    axis = arguments.array("up", up, (3,))
    if not axis.any():
        raise ValueError("up must not be zero")
    return native.under_sky(above, below, [float(x) for x in axis / np.abs(axis).max()])


def _looked_at(native: _native.Scene, camera: Any) -> _native.Scene:
    if not isinstance(camera, Camera):
        raise TypeError(f"camera must be a Camera, not {camera!r}")
    return native.looked_at(list(camera.position), list(camera.target), list(camera.up), camera.vertical_fov)


def load(
    file: str | os.PathLike[str],
    *,
    two_sided: bool = False,
    reflectance: float | None = None,
    light: Literal["ceiling", "sky"] | None = None,
    highlights: bool = False,
    camera: str | None = None,
    unit: Literal["m", "cm", "mm", "in", "ft"] | None = None,
    as_modelled: bool = False,
) -> Scene:
    """Reads a scene.

    Parameters
    ----------
    file : str or path
        An ``.obj`` (with its MTL), ``.glb``, ``.gltf`` or ``.toml`` file, or the name of a built-in scene
        (:func:`scenes`).
    two_sided : bool
        Give all materials two sides for which no scene file says otherwise.
    reflectance : float, optional
        Reflectance, 0 to 1, of faces for which the files have no material: 0.5, in glTF 0.8.
    light : {"ceiling", "sky"}, optional
        Light that the files do not have: a luminaire below the ceiling, or a sky of radiance 1 W/(m² sr).
    highlights : bool
        Show highlights of direct light by Ks and Ns of the materials.
    camera : str, optional
        Look through the file's camera of this name.
    unit : {"m", "cm", "mm", "in", "ft"}, optional
        Unit of positions in the files, which lights without area need; that of the scene file, else metres, where it
        is left out.
    as_modelled : bool
        Leave rooms whose faces look outward as they are. A closed one that the camera is in is turned otherwise.

    Returns
    -------
    Scene

    Raises
    ------
    SceneError
        A file that cannot be read, or the first mistake in it, with ``.file`` and ``.line``.

    Warns
    -----
    SceneWarning
        What of the file the scene does not have.
    """
    found = _native.open_scene(
        arguments.path("file", file),
        arguments.flag("two_sided", two_sided),
        None if reflectance is None else arguments.real("reflectance", reflectance, 0.0, 1.0),
        None if light is None else arguments.choice("light", light, ["ceiling", "sky"]),
        arguments.flag("highlights", highlights),
        None if camera is None else arguments.text("camera", camera),
        None if unit is None else arguments.choice("unit", unit, ["m", "cm", "mm", "in", "ft"]),
        arguments.flag("as_modelled", as_modelled),
    )
    scene = Scene._of(found)
    scene._warn()
    return scene


def scenes() -> dict[str, str]:
    """The built-in scenes: a line on each, by its name."""
    return dict(_native.builtin_scenes())


def cornell_box() -> Scene:
    """The Cornell box of the Cornell University Program of Computer Graphics."""
    return load("cornell-box")
