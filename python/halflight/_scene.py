"""Scenes: read from files, built in, or made from arrays."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, cast

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native, _show
from halflight._camera import Camera
from halflight._errors import SceneWarning, in_python
from halflight._fixed import Fixed
from halflight._lights import Given, PointLight, SpotLight, SunLight
from halflight._materials import Material
from halflight._meshes import Mesh, joined, polygons, taken
from halflight._sky import under_patches, under_sky

__all__ = ["Arrays", "Scene", "cornell_box", "load", "native_of", "scenes"]

Light = PointLight | SpotLight | SunLight
Unit = Literal["m", "cm", "mm", "in", "ft"]
UNITS = ("m", "cm", "mm", "in", "ft")


@dataclass(frozen=True)
class Arrays:
    """All of a scene but camera and sky, as the native module takes it."""

    name: str
    vertices: npt.NDArray[np.float64]
    uv: npt.NDArray[np.float32] | None
    corners: npt.NDArray[np.uint32]
    counts: npt.NDArray[np.uint32]
    face_material: npt.NDArray[np.uint32]
    face_object: npt.NDArray[np.uint32]
    materials: list[Material]
    objects: list[str]
    lights: list[Given]
    unit: str


class Scene(Fixed):
    """A checked scene: triangles, materials, lights and a camera. It never changes.

    Made from arrays here, of named objects by :meth:`from_objects`, read from files by :func:`load`. Its rays are
    made ready when something is first solved for it, and kept for all that follows.

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
    uv : (n, 2) floats, optional
        Texture coordinates of the vertices, which :class:`Texture` explains; materials with textures need them.
    lights : sequence of PointLight, SpotLight and SunLight
        Lights without area.
    unit : {"m", "cm", "mm", "in", "ft"}
        What a length of 1 is, for the ``1/d²`` of lights and for powers.
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

    _instead = "with_camera, with_material and with_sky make another scene"

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
        uv: npt.ArrayLike | None = None,
        lights: Sequence[Light] = (),
        unit: Unit = "m",
        camera: Camera | None = None,
        sky: npt.ArrayLike | None = None,
        name: str = "scene",
    ) -> None:
        name = arguments.text("name", name)
        points = arguments.array("vertices", vertices, ("n", 3))
        corners, counts = polygons(faces, len(points))
        kinds = arguments.list_of("materials", materials, Material)
        if not kinds:
            raise ValueError("materials must not be empty")
        names = [name] if objects is None else arguments.sequence("objects", objects)
        count = len(counts)
        arrays = Arrays(
            name,
            points,
            _coordinates(uv, len(points), kinds),
            corners,
            counts,
            _given("face_material", face_material, count, len(kinds), "materials"),
            _given("face_object", face_object, count, len(names), "objects"),
            kinds,
            [arguments.text("objects", one) for one in names],
            [light.given() for light in arguments.list_of("lights", lights, (PointLight, SpotLight, SunLight))],
            arguments.choice("unit", unit, UNITS),
        )
        self._become(_native.scene_from_arrays(arrays), camera, sky)
        _warn_of(self, 3)

    @classmethod
    def from_objects(
        cls,
        objects: Mapping[str, Any],
        *,
        lights: Sequence[Light] = (),
        unit: Unit = "m",
        camera: Camera | None = None,
        sky: npt.ArrayLike | None = None,
        name: str = "scene",
    ) -> Scene:
        """A scene of named objects, each a mesh and what it is made of.

        Parameters
        ----------
        objects : mapping of str to (vertices, faces, Material), (mesh, Material), or mesh
            ``vertices`` and ``faces`` are as those of :class:`Scene`. A mesh is what :func:`box` and :func:`quad` make,
            a :class:`Mesh`, a mesh of trimesh or pyvista as it is, or a list of these as one. One without a material
            reflects 0.5. Objects with equal materials share one.
        lights, unit, camera, sky, name
            As of :class:`Scene`.

        Returns
        -------
        Scene
            Its ``objects`` are the names, in their order.

        Raises
        ------
        TypeError, ValueError
            An object that is none of these, an object with a texture and without coordinates, or two materials of one
            name that differ.
        SceneError
            As from :class:`Scene`.

        Examples
        --------
        >>> import halflight as hl
        >>> room = hl.Scene.from_objects(
        ...     {
        ...         "walls": (hl.box([0, 0, 0], [4, 2.5, 3], inward=True), hl.Material("plaster", 0.7)),
        ...         "table": (hl.box([1, 0.7, 1], [2, 0.75, 2]), hl.Material("wood", [0.5, 0.4, 0.3])),
        ...     },
        ...     lights=[hl.PointLight([2, 2.3, 1.5], intensity=10)],
        ... )
        >>> room.objects, room.triangles
        (['walls', 'table'], 24)
        """
        if not isinstance(objects, Mapping) or not objects:
            raise TypeError(f"objects must be a mapping of names to meshes and materials, not {objects!r}")
        parts = [_part(own, given) for own, given in objects.items()]
        kinds: list[Material] = []
        for _, material in parts:
            if material not in kinds:
                kinds.append(material)
        if len({kind.name for kind in kinds}) < len(kinds):
            twice = [kind.name for kind in kinds]
            named = next(one for one in twice if twice.count(one) > 1)
            raise ValueError(f"two materials that differ are called {named!r}: give each a name of its own")
        is_textured = any(kind.is_textured for kind in kinds)
        whole = joined([mesh if not is_textured else _with_coordinates(mesh) for mesh, _ in parts])
        lengths = [len(mesh.faces) for mesh, _ in parts]
        return cls(
            whole.vertices,
            whole.faces,
            kinds,
            np.repeat([kinds.index(material) for _, material in parts], lengths),
            objects=list(objects),
            face_object=np.repeat(np.arange(len(parts)), lengths),
            uv=whole.uv if is_textured else None,
            lights=lights,
            unit=unit,
            camera=camera,
            sky=sky,
            name=name,
        )

    def _become(self, native: _native.Scene, camera: Camera | None = None, sky: Any = None) -> None:
        """Takes what it holds: a native scene, under another sky and behind another camera where they are given."""
        if sky is not None:
            native = under_sky(native, sky)
        self._held = native if camera is None else _looked_at(native, camera)
        self._camera = camera
        self._fix()

    @classmethod
    def _of(cls, native: _native.Scene, camera: Camera | None = None) -> Scene:
        scene = cls.__new__(cls)
        scene._held = native
        scene._camera = camera
        scene._fix()
        return scene

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
        """What the faces are made of; their textures are not shown."""

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
        known = [found[0] for found in self._held.materials()]
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
        return Scene._of(under_sky(self._held, radiance, lower, up), self._camera)

    def with_sky_patches(
        self, radiance: npt.ArrayLike, up: npt.ArrayLike = (0.0, 1.0, 0.0), north: npt.ArrayLike | None = None
    ) -> Scene:
        """The same scene under a sky of patches.

        Parameters
        ----------
        radiance : (n,) or (n, 3) floats
            Radiance of the ground and of each patch of Reinhart's MF:k, W/(m² sr), n = 2 + 144 k²: 146 (Tregenza),
            578, and so on; from the horizon up, from north clockwise seen from above, the zenith last, as Radiance's
            ``gendaymtx`` and ``hl.daylight`` have them.
        up : (3,) floats
            What is above.
        north : (3,) floats, optional
            Where the first patch of each row lies; -z where y is up and +y where z is.
        """
        return Scene._of(under_patches(self._held, radiance, up, north), self._camera)

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


def native_of(scene: Any) -> _native.Scene:
    """The native part of a scene."""
    if not isinstance(scene, Scene):
        hint = ": read it with halflight.load first" if isinstance(scene, (str, os.PathLike)) else ""
        raise TypeError(f"scene must be a halflight.Scene, not {scene!r}{hint}")
    return scene._held


def _warn_of(scene: Scene, level: int) -> None:
    """Warns of what a reader left out, as from so many calls further out."""
    for warning in scene.warnings:
        warnings.warn(in_python(warning), SceneWarning, stacklevel=level + 1)


def _part(name: Any, given: Any) -> tuple[Mesh, Material]:
    """The mesh and the material of an object."""
    arguments.text("the name of an object", name)
    parts = given if isinstance(given, tuple) else (given, Material("grey"))
    if len(parts) not in (2, 3) or not isinstance(parts[-1], Material):
        raise TypeError(f"objects[{name!r}] must be (vertices, faces, Material), (mesh, Material) or a mesh")
    try:
        mesh = taken(parts[0]) if len(parts) == 2 else Mesh(parts[0], parts[1])
    except (TypeError, ValueError) as error:
        raise type(error)(f"objects[{name!r}]: {error}") from None
    if parts[-1].is_textured and mesh.uv is None:
        raise ValueError(f"objects[{name!r}] has a texture, so that its mesh needs coordinates: hl.Mesh(..., uv=...)")
    return mesh, parts[-1]


def _with_coordinates(mesh: Mesh) -> Mesh:
    """A mesh with texture coordinates, which are 0 where it has none."""
    return mesh if mesh.uv is not None else Mesh(mesh.vertices, mesh.faces, np.zeros((len(mesh.vertices), 2)))


def _coordinates(uv: Any, vertices: int, materials: list[Material]) -> npt.NDArray[np.float32] | None:
    """Texture coordinates of all vertices."""
    if uv is not None:
        return arguments.array("uv", uv, (vertices, 2), np.float32)
    textured = [material.name for material in materials if material.is_textured]
    if textured:
        raise ValueError(f"uv is needed, (n, 2) coordinates of the vertices: material {textured[0]!r} has a texture")
    return None


def _given(name: str, value: Any, count: int, most: int, what: str) -> npt.NDArray[np.uint32]:
    if value is None:
        return np.zeros(count, dtype=np.uint32)
    found = arguments.indices(name, value, ("m",), most, what)
    if len(found) != count:
        raise ValueError(f"{name} must have the shape ({count},), one for each face, not {found.shape}")
    return found


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
    unit: Unit | None = None,
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
        None if unit is None else arguments.choice("unit", unit, UNITS),
        arguments.flag("as_modelled", as_modelled),
    )
    scene = Scene._of(found)
    _warn_of(scene, 2)
    return scene


def scenes() -> dict[str, str]:
    """The built-in scenes: a line on each, by its name."""
    return dict(_native.builtin_scenes())


def cornell_box() -> Scene:
    """The Cornell box of the Cornell University Program of Computer Graphics."""
    return load("cornell-box")
