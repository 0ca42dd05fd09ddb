"""Meshes: boxes and quads, those of trimesh and pyvista, and several as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments

__all__ = ["Mesh", "box", "joined", "polygons", "quad"]

Float64 = npt.NDArray[np.float64]

SIDES = ("-x", "+x", "-y", "+y", "-z", "+z")
#: Corners of the sides of the unit cube, counter-clockwise seen from outside; the first two are the lower edge.
CUBE = np.array(
    [
        [[0, 0, 0], [0, 0, 1], [0, 1, 1], [0, 1, 0]],
        [[1, 0, 1], [1, 0, 0], [1, 1, 0], [1, 1, 1]],
        [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]],
        [[0, 1, 1], [1, 1, 1], [1, 1, 0], [0, 1, 0]],
        [[1, 0, 0], [0, 0, 0], [0, 1, 0], [1, 1, 0]],
        [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
    ]
)
#: Texture coordinates of a quad's corners.
SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


@dataclass(frozen=True, eq=False)
class Mesh:
    """Polygons, as :meth:`Scene.from_objects` takes them; :func:`box` and :func:`quad` make some.

    Parameters
    ----------
    vertices : (n, 3) floats
        Corner points.
    faces : (m, k) ints, or a sequence of m sequences of ints
        Corners of each polygon, k of 3 or more, counted from 0, counter-clockwise seen from the front.
    uv : (n, 2) floats, optional
        Texture coordinates of the vertices; see :class:`Texture`.

    Raises
    ------
    TypeError, ValueError
        Arrays of other shapes or kinds, or a face of vertices that are not there.
    """

    vertices: Any
    faces: Any
    uv: Any = None

    def __post_init__(self) -> None:
        points = arguments.array("vertices", self.vertices, ("n", 3))
        polygons(self.faces, len(points))
        uv = None if self.uv is None else arguments.array("uv", self.uv, (len(points), 2))
        object.__setattr__(self, "vertices", points)
        object.__setattr__(self, "uv", uv)

    def __repr__(self) -> str:
        return f"<halflight.Mesh: {len(self.vertices)} vertices, {len(self.faces)} faces>"


def _of_quads(corners: Float64) -> Mesh:
    """A mesh of quads, (m, 4, 3), each with the whole of a texture."""
    count = len(corners)
    faces = np.arange(4 * count).reshape(count, 4)
    return Mesh(corners.reshape(-1, 3), faces, np.tile(SQUARE, (count, 1)))


def quad(corner: npt.ArrayLike, u: npt.ArrayLike, v: npt.ArrayLike) -> Mesh:
    """A parallelogram: ``corner + s u + t v`` for s and t from 0 to 1. Its front is where ``u × v`` points.

    Parameters
    ----------
    corner, u, v : (3,) floats
        A corner and the two edges from it. Texture coordinates are (s, t).

    Returns
    -------
    Mesh
        Four vertices, one face.

    Raises
    ------
    ValueError
        Edges that lie on one line.

    Examples
    --------
    >>> import halflight as hl
    >>> hl.quad([0, 0, 0], [0, 0, 1], [1, 0, 0]).vertices.tolist()  # faces up
    [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, 0.0]]
    """
    start, first, second = (arguments.array(n, x, (3,)) for n, x in (("corner", corner), ("u", u), ("v", v)))
    if not np.cross(first, second).any():
        raise ValueError(f"u and v must not lie on one line, and {first.tolist()} and {second.tolist()} do")
    return _of_quads(np.array([[start, start + first, start + first + second, start + second]]))


def box(
    lo: npt.ArrayLike,
    hi: npt.ArrayLike,
    *,
    inward: bool = False,
    sides: str | Sequence[str] = SIDES,
) -> Mesh:
    """A box along the axes, or some of its sides.

    Parameters
    ----------
    lo, hi : (3,) floats
        Opposite corners, ``lo < hi`` along every axis.
    inward : bool
        Whether the fronts are inside, as those of a room, or outside, as those of furniture.
    sides : {"-x", "+x", "-y", "+y", "-z", "+z"} or several
        Which sides, by the axis along which they lie lowest or highest; all where they are left out.

    Returns
    -------
    Mesh
        Four vertices and one face for each side, in the order of ``sides``. Texture coordinates run from (0, 0) to
        (1, 1) over each.

    Raises
    ------
    ValueError
        A box without a volume, or a side that is none.

    Examples
    --------
    >>> import halflight as hl
    >>> hl.box([0, 0, 0], [6, 3, 4], inward=True, sides="-y")  # a floor
    <halflight.Mesh: 4 vertices, 1 faces>
    """
    low, high = arguments.array("lo", lo, (3,)), arguments.array("hi", hi, (3,))
    if (low >= high).any():
        axis = int(np.argmax(low >= high))
        raise ValueError(f"hi[{axis}] must be above lo[{axis}], and {high[axis]:g} is not above {low[axis]:g}")
    chosen = arguments.choices("sides", sides, SIDES)
    if not chosen:
        raise ValueError("sides must name one side or more")
    unit = CUBE[[SIDES.index(side) for side in chosen]]
    if arguments.flag("inward", inward):
        # The lower edge the other way round, so that textures are no mirror images.
        unit = unit[:, [1, 0, 3, 2]]
    return _of_quads(np.where(unit == 1, high, low))


def polygons(faces: Any, vertices: int) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
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
        for k, row in enumerate(arguments.sequence("faces", faces))
    ]
    for k, row in enumerate(rows):
        if len(row) < 3:
            raise ValueError(f"faces[{k}] must have three corners or more, not {len(row)}")
    if not rows:
        raise ValueError("faces must have the shape (m, k), k of 3 or more, and m is 0")
    return np.concatenate(rows), np.array([len(row) for row in rows], dtype=np.uint32)


def _of_pyvista(mesh: Any) -> Mesh:
    """A mesh of pyvista: its polygons, or the surface of what has volumes."""
    surface = mesh if hasattr(mesh, "faces") else mesh.extract_surface()
    uv = getattr(surface, "active_texture_coordinates", None)
    return Mesh(np.asarray(surface.points), _counted(np.asarray(surface.faces)), uv)


def _counted(flat: npt.NDArray[Any]) -> Any:
    """Polygons of a list that has before each of them how many corners it has."""
    wide = int(flat[0]) + 1 if len(flat) else 1
    if len(flat) % wide == 0 and (flat[::wide] == wide - 1).all():
        return flat.reshape(-1, wide)[:, 1:]
    rows, start = [], 0
    while start < len(flat):
        end = start + 1 + int(flat[start])
        rows.append(flat[start + 1 : end])
        start = end
    return rows


def taken(mesh: Any) -> Mesh:
    """A mesh of any kind: halflight's, trimesh's (``vertices`` and ``faces``), pyvista's, or several as one."""
    if isinstance(mesh, Mesh):
        return mesh
    if isinstance(mesh, (list, tuple)):
        return joined([taken(one) for one in mesh])
    if hasattr(mesh, "points") and hasattr(mesh, "n_cells"):
        return _of_pyvista(mesh)
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        uv = getattr(getattr(mesh, "visual", None), "uv", None)
        return Mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces), uv)
    raise TypeError(
        "a mesh must be a halflight.Mesh (hl.box, hl.quad), have vertices and faces (trimesh), be one of pyvista's, or "
        f"a list of these, not {type(mesh).__name__}"
    )


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """Several meshes as one; it has texture coordinates where all of them have."""
    if not meshes:
        raise ValueError("a list of meshes must not be empty")
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    tables = [np.asarray(mesh.faces) for mesh in meshes if hasattr(mesh.faces, "dtype")]
    if len(tables) == len(meshes) and len({table.shape[1] for table in tables}) == 1:
        faces: Any = np.concatenate([table + start for table, start in zip(tables, starts)])
    else:
        faces = [np.asarray(face) + start for mesh, start in zip(meshes, starts) for face in mesh.faces]
    uv = None if any(mesh.uv is None for mesh in meshes) else np.concatenate([mesh.uv for mesh in meshes])
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), faces, uv)
