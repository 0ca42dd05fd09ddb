"""Where patches are and what they are made of, and F between them as SciPy's matrix."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native
from halflight._fixed import Fixed
from halflight._kept import again, kept

if TYPE_CHECKING:
    import scipy.sparse

__all__ = ["Patches", "sparse"]

Float32 = npt.NDArray[np.float32]


class Patches(Fixed):
    """The patches of a solution: every property is an array with an entry for each patch.

    Lengths are in the scene's units. A side of a surface is a patch of its own. The halves of a sky are patches too,
    with areas of their stand-ins, which norms and the power of E count.
    """

    _instead = "solve again: halflight.solve(scene, ...)"

    def __init__(self, system: _native.System) -> None:
        self._system = system
        self._fix()

    def __len__(self) -> int:
        return self._system.patches()

    def __repr__(self) -> str:
        return f"<halflight.Patches: {len(self)}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return (again, (Patches, self._system.scene().to_bytes(), kept(self._system)))

    def __copy__(self) -> Patches:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Patches:
        return self

    @property
    def areas(self) -> npt.NDArray[np.float64]:
        """Areas, (n,) float64; a view."""
        return cast("npt.NDArray[np.float64]", self._system.areas())

    @property
    def centres(self) -> npt.NDArray[np.float64]:
        """Middles, (n, 3) float64; NaN for the halves of a sky."""
        return self._places[0]

    @property
    def normals(self) -> Float32:
        """Unit normals, means over each patch, (n, 3) float32."""
        return self._places[1]

    @property
    def rho(self) -> Float32:
        """Reflectances, (n, 3) float32; a view."""
        return cast("Float32", self._system.rho())

    @property
    def alpha(self) -> Float32:
        """Shares of what is reflected that travel on, (n,) float32; a view."""
        return cast("Float32", self._system.alpha())

    @property
    def emission(self) -> Float32:
        """E, (n, 2, 3) float32, W/(m² sr); a view."""
        return cast("Float32", self._system.emission())

    @property
    def materials(self) -> npt.NDArray[np.uint32]:
        """Numbers of materials of the scene, (n,) uint32; a view. Those of a sky come after the scene's."""
        return cast("npt.NDArray[np.uint32]", self._system.materials())

    @property
    def objects(self) -> npt.NDArray[np.uint32]:
        """Numbers of objects of the scene, (n,) uint32; that of a sky comes after the scene's."""
        return cast("npt.NDArray[np.uint32]", self._system.objects())

    @property
    def triangles(self) -> npt.NDArray[np.float64]:
        """Corners of the triangles that patches consist of, (m, 3, 3) float64: triangle, corner, coordinate."""
        return self._meshed[0]

    @property
    def triangle_patch(self) -> npt.NDArray[np.uint32]:
        """The patch that each triangle is a part of, (m,) uint32, ascending; a view. All are of ``whole``."""
        return self._meshed[1]

    @property
    def whole(self) -> npt.NDArray[np.uint32]:
        """The patch that each is a part of, (n,) uint32; itself where it was not divided.

        Where surfaces touch or a shadow's edge would run through them, patches are divided by points; the parts lie
        mixed on the triangles of the whole.
        """
        return cast("npt.NDArray[np.uint32]", self._system.wholes())

    def on_triangles(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Numbers of patches as numbers of ``triangles``: of a divided patch the mean by area.

        Parameters
        ----------
        values : (n, ...) array
            A number, or several, of each patch.

        Returns
        -------
        (m, ...) array
        """
        given = np.asarray(values)
        if given.shape[:1] != (len(self),):
            raise ValueError(f"values must have the shape ({len(self)}, ...), not {given.shape}")
        whole = self.whole
        owner = self.triangle_patch
        parts = np.flatnonzero(np.bincount(whole, minlength=len(self))[whole] > 1)
        if len(parts) == 0 or given.dtype.kind not in "f":
            return given[owner]
        areas = self.areas.reshape(-1, *[1] * (given.ndim - 1))
        sums, weights = np.zeros(given.shape), np.zeros(areas.shape)
        np.add.at(sums, whole[parts], areas[parts] * given[parts])
        np.add.at(weights, whole[parts], areas[parts])
        means = given.copy()
        own = np.unique(whole[parts])
        means[own] = sums[own] / np.maximum(weights[own], np.finfo(float).tiny)
        return means[owner]

    def faces(self, patch: int) -> npt.NDArray[np.float64]:
        """Corners of the triangles of one patch, (k, 3, 3) float64; of a part those of the whole, of a sky's none."""
        number = int(self.whole[arguments.integer("patch", patch, 0, len(self) - 1)])
        corners, owners = self._meshed
        begin, end = np.searchsorted(owners, [number, number + 1])
        return corners[begin:end]

    @cached_property
    def _places(self) -> tuple[npt.NDArray[np.float64], Float32]:
        return self._system.places()

    @cached_property
    def _meshed(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]]:
        return self._system.triangles()


def sparse(rows: tuple[npt.NDArray[np.int64], npt.NDArray[np.uint32], Float32], n: int) -> scipy.sparse.csr_array:
    """F of its row starts, columns and values as a CSR matrix over their memory."""
    import scipy.sparse

    starts, indices, data = rows
    if len(data) < 2**31:
        starts = starts.astype(np.int32)
    matrix = scipy.sparse.csr_array((data, indices.view(np.int32), starts), shape=(n, n), copy=False)
    matrix.has_sorted_indices = True
    return matrix
