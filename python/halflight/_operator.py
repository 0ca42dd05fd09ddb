"""K as SciPy's LinearOperator. This file imports SciPy, where it is there, and is imported when K is asked for."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native
from halflight._fixed import Fixed
from halflight._kept import again, kept
from halflight._patches import Patches, sparse

if TYPE_CHECKING:
    import scipy.sparse

__all__ = ["Operator"]

try:
    from scipy.sparse.linalg import LinearOperator
except ImportError:

    class LinearOperator:  # type: ignore[no-redef]
        """What K is where SciPy is missing: its products alone."""

        def dot(self, x: Any) -> Any:
            raise ImportError(f"K times {x!r} is an operator of SciPy: pip install scipy")


Float32 = npt.NDArray[np.float32]


class Operator(Fixed, LinearOperator):  # type: ignore[misc]
    """K, the transport operator: ``K_ij = F_ij rho_i [[alpha_i, 0], [1, 0]]`` for each channel.

    It acts on vectors of 6 n numbers: light (n, 2, 3) of the patches laid out flat, invisible half first, channels red,
    green, blue. Where SciPy is there it is a ``scipy.sparse.linalg.LinearOperator``: iterative and eigenvalue solvers
    take it as it is, and ``K.T``, ``K.H``, ``2 * K``, ``K + A``, ``K @ A`` and ``K**2`` are operators too.

    Luminaires light the patches by closed form and not by F, so that the equation to solve is
    ``x = first_bounce + K x``, and ``L = emission + x``.

    Attributes
    ----------
    shape : (int, int)
        (6 n, 6 n).
    dtype : dtype
        float32, as K is computed.

    Notes
    -----
    Products are in single precision, whatever the vector's: each number of K x is rounded to 6e-8 of itself. So ask
    solvers for an ``rtol`` of 1e-5 or more: below that the residual they see may be rounding, and they may not end. For
    double precision take :meth:`matrix` of a channel, ``K.matrix(0).astype(float)``, which holds the same K.

    Examples
    --------
    >>> import halflight as hl, numpy as np
    >>> K = hl.solve(hl.cornell_box(), patches=300, rays=64).operator
    >>> x = K.first_bounce.ravel()
    >>> bool(np.allclose(K.matvec(x), K @ x)) and K.shape == (x.size, x.size)
    True
    """

    ndim = 2
    _instead = "solve again for another K: halflight.solve(scene, ...)"

    def __init__(self, system: _native.System) -> None:
        self._system = system
        n = 6 * system.patches()
        self.shape: tuple[int, int] = (n, n)
        self.dtype: np.dtype[np.float32] = np.dtype(np.float32)
        self._fix()

    def __repr__(self) -> str:
        return f"<halflight.Operator K: {self.shape[0]}x{self.shape[1]}, float32>"

    def __reduce__(self) -> tuple[Any, ...]:
        return (again, (Operator, self._system.scene().to_bytes(), kept(self._system)))

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
        return cast("Float32", self._system.apply_columns(self._columns("x", x)))

    def rmatmat(self, y: npt.ArrayLike) -> Float32:
        """Kᵀ Y of many columns, one after the other.

        Parameters
        ----------
        y : (6 n, m) floats

        Returns
        -------
        (6 n, m) float32
        """
        columns = np.ascontiguousarray(self._columns("y", y).T)
        return np.stack([self._system.apply_transposed(column) for column in columns], axis=1)

    def _columns(self, name: str, x: Any) -> Float32:
        n = self.shape[0]
        given = np.asarray(x)
        if given.dtype.kind not in "fiu" or given.ndim != 2 or given.shape[0] != n:
            raise (TypeError if given.dtype.kind not in "fiu" else ValueError)(
                f"{name} must be numbers of shape ({n}, m), not {given.shape} ({given.dtype})"
            )
        return given.astype(np.float32, copy=False)

    # What SciPy's sums, multiples and transposes of K ask for.
    _matvec, _rmatvec, _matmat, _rmatmat = matvec, rmatvec, matmat, rmatmat

    def __matmul__(self, x: Any) -> Any:
        """K x, K X of a matrix of columns, or K A of another operator."""
        if isinstance(x, LinearOperator):
            return super().dot(x)
        given = np.asarray(x)
        return self.matmat(given) if given.ndim == 2 and given.shape[1] != 1 else self.matvec(given)

    def dot(self, x: Any) -> Any:
        """``K @ x``, or K times a number, as of numpy's matrices."""
        return super().dot(x) if np.isscalar(x) else self @ x

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

    @cached_property
    def first_bounce(self) -> Float32:
        """K E with luminaires by closed form, (n, 2, 3) float32."""
        found = self._system.first_bounce().reshape(-1, 2, 3)
        found.flags.writeable = False
        return cast("Float32", found)

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
