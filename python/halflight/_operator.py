"""K as SciPy's solvers take it, and where its patches are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native
from halflight._kept import Kept, assembled_again, kept

if TYPE_CHECKING:
    import scipy.sparse
    import scipy.sparse.linalg

__all__ = ["Operator", "Patches"]

Float32 = npt.NDArray[np.float32]


class Patches:
    """The patches of a solution: every property is an array with an entry for each patch.

    Lengths are in the scene's units. A side of a surface is a patch of its own. The halves of a sky are patches too,
    with areas of their stand-ins, which norms and the power of E count.
    """

    def __init__(self, system: _native.System) -> None:
        self._system = system
        self._places: tuple[npt.NDArray[np.float64], Float32] | None = None
        self._triangles: tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]] | None = None

    def __len__(self) -> int:
        return self._system.patches()

    def __repr__(self) -> str:
        return f"<halflight.Patches: {len(self)}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return (_again, (Patches, self._system.scene().to_bytes(), kept(self._system)))

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
        return self._found()[0]

    @property
    def normals(self) -> Float32:
        """Unit normals, means over each patch, (n, 3) float32."""
        return self._found()[1]

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
        return self._meshed()[0]

    @property
    def triangle_patch(self) -> npt.NDArray[np.uint32]:
        """The patch that each triangle is a part of, (m,) uint32, ascending; a view. All are of ``whole``."""
        return self._meshed()[1]

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
        corners, owners = self._meshed()
        begin, end = np.searchsorted(owners, [number, number + 1])
        return corners[begin:end]

    def _found(self) -> tuple[npt.NDArray[np.float64], Float32]:
        if self._places is None:
            self._places = self._system.places()
        return self._places

    def _meshed(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]]:
        if self._triangles is None:
            self._triangles = self._system.triangles()
        return self._triangles


class Operator:
    """K, the transport operator: ``K_ij = F_ij rho_i [[alpha_i, 0], [1, 0]]`` for each channel.

    It acts on vectors of 6 n numbers: light (n, 2, 3) of the patches laid out flat, invisible half first, channels red,
    green, blue. SciPy's iterative solvers and eigenvalue solvers take it as it is.

    Luminaires light the patches by closed form and not by F, so that the equation to solve is
    ``x = first_bounce + K x``, and ``L = emission + x``.

    Attributes
    ----------
    shape : (int, int)
        (6 n, 6 n).
    dtype : dtype
        float32, as K is computed.

    Examples
    --------
    >>> import halflight as hl, numpy as np
    >>> K = hl.solve(hl.cornell_box(), patches=300, rays=64).operator
    >>> x = K.first_bounce.ravel()
    >>> bool(np.allclose(K.matvec(x), K @ x)) and K.shape == (x.size, x.size)
    True
    """

    ndim = 2

    def __init__(self, system: _native.System) -> None:
        self._system = system
        self._first: Float32 | None = None
        n = 6 * system.patches()
        self.shape = (n, n)
        self.dtype = np.dtype(np.float32)

    def __repr__(self) -> str:
        return f"<halflight.Operator K: {self.shape[0]}x{self.shape[1]}, float32>"

    def __reduce__(self) -> tuple[Any, ...]:
        return (_again, (Operator, self._system.scene().to_bytes(), kept(self._system)))

    def __copy__(self) -> Operator:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Operator:
        return self

    # Products.

    def _flat(self, name: str, x: Any) -> tuple[Float32, tuple[int, ...]]:
        n = self.shape[0]
        given = np.asarray(x)
        if given.dtype.kind not in "fiu" or given.size != n or given.shape not in [(n,), (n, 1), (n // 6, 2, 3)]:
            raise (TypeError if given.dtype.kind not in "fiu" else ValueError)(
                f"{name} must be numbers of shape ({n},), ({n}, 1) or ({n // 6}, 2, 3), "
                f"not {given.shape} ({given.dtype})"
            )
        with np.errstate(over="ignore"):
            return np.ascontiguousarray(given, np.float32).reshape(n), given.shape

    def matvec(self, x: npt.ArrayLike) -> Float32:
        """K x.

        Parameters
        ----------
        x : (6 n,), (6 n, 1) or (n, 2, 3) floats

        Returns
        -------
        array of the shape of x, float32
        """
        flat, shape = self._flat("x", x)
        return cast("Float32", self._system.apply(flat).reshape(shape))

    def rmatvec(self, y: npt.ArrayLike) -> Float32:
        """Kᵀ y, shapes as in :meth:`matvec`. The first call transposes F and keeps it: as much memory again."""
        flat, shape = self._flat("y", y)
        return cast("Float32", self._system.apply_transposed(flat).reshape(shape))

    def matmat(self, x: npt.ArrayLike) -> Float32:
        """K X of many columns in one pass over F for each 16 of them.

        Parameters
        ----------
        x : (6 n, m) floats

        Returns
        -------
        (6 n, m) float32
        """
        n = self.shape[0]
        given = np.asarray(x)
        if given.dtype.kind not in "fiu" or given.ndim != 2 or given.shape[0] != n:
            raise (TypeError if given.dtype.kind not in "fiu" else ValueError)(
                f"x must be numbers of shape ({n}, m), not {given.shape} ({given.dtype})"
            )
        return cast("Float32", self._system.apply_columns(given.astype(np.float32, copy=False)))

    def __matmul__(self, x: npt.ArrayLike) -> Float32:
        """K x, or K X of a matrix of columns."""
        given = np.asarray(x)
        return self.matmat(given) if given.ndim == 2 and given.shape[1] != 1 else self.matvec(given)

    #: K x, as of numpy's matrices.
    dot = __matmul__

    def one_minus(self) -> scipy.sparse.linalg.LinearOperator:
        """I - K for SciPy: ``scipy.sparse.linalg.gmres(K.one_minus(), K.first_bounce.ravel())``; needs scipy."""
        import scipy.sparse.linalg

        return scipy.sparse.linalg.LinearOperator(
            self.shape,
            matvec=lambda x: np.ravel(x) - self.matvec(np.ravel(x)),
            rmatvec=lambda y: np.ravel(y) - self.rmatvec(np.ravel(y)),
            matmat=lambda x: x - self.matmat(x),
            dtype=self.dtype,
        )

    # What it is made of.

    @property
    def patches(self) -> Patches:
        """Its patches."""
        return Patches(self._system)

    @property
    def emission(self) -> Float32:
        """E, (n, 2, 3) float32, W/(m² sr); a view."""
        return cast("Float32", self._system.emission())

    @property
    def first_bounce(self) -> Float32:
        """K E with luminaires by closed form, (n, 2, 3) float32."""
        if self._first is None:
            self._first = self._system.first_bounce().reshape(-1, 2, 3)
            self._first.flags.writeable = False
        return self._first

    @property
    def F(self) -> scipy.sparse.csr_array:
        """F as SciPy's CSR matrix (n, n), float32, over the memory that halflight has it in.

        Rows of patches that reflect nothing and columns of those that send nothing through F are empty; luminaires' are
        among these. :func:`halflight.patch_factors` has all.
        """
        return sparse((self._system.starts(), *self._system.factors()), len(self.patches))

    def matrix(self, channel: int) -> scipy.sparse.bsr_array:
        """K of one channel (0 red, 1 green, 2 blue) as SciPy's matrix of 2×2 blocks, (2 n, 2 n) float32; a copy."""
        import scipy.sparse

        c = arguments.integer("channel", channel, 0, 2)
        F = self.F
        rows = np.repeat(np.arange(F.shape[0]), np.diff(F.indptr))
        weights = F.data * self.patches.rho[rows, c]
        blocks = np.zeros((len(weights), 2, 2), np.float32)
        blocks[:, 0, 0] = self.patches.alpha[rows] * weights
        blocks[:, 1, 0] = weights
        return scipy.sparse.bsr_array((blocks, F.indices, F.indptr), shape=(2 * F.shape[0], 2 * F.shape[1]))


def _again(kind: Any, scene: bytes, own: Kept) -> Any:
    return kind(assembled_again(_native.scene_from_bytes(scene), own))


def sparse(rows: tuple[npt.NDArray[np.int64], npt.NDArray[np.uint32], Float32], n: int) -> scipy.sparse.csr_array:
    """F of its row starts, columns and values as a CSR matrix over their memory."""
    import scipy.sparse

    starts, indices, data = rows
    if len(data) < 2**31:
        starts = starts.astype(np.int32)
    matrix = scipy.sparse.csr_array((data, indices.view(np.int32), starts), shape=(n, n), copy=False)
    matrix.has_sorted_indices = True
    return matrix
