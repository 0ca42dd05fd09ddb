"""Form factors: between the objects of a scene under their names, and between its patches."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native, _show
from halflight._errors import ToleranceWarning
from halflight._fixed import Fixed
from halflight._patches import sparse
from halflight._scene import Scene, native_of

if TYPE_CHECKING:
    import pandas
    import scipy.sparse

__all__ = ["Factors", "PatchFactors", "factors", "patch_factors"]

Float64 = npt.NDArray[np.float64]


@dataclass(frozen=True, repr=False, eq=False)
class Factors:
    """Form factors between n objects.

    Attributes
    ----------
    names : list of str
        The objects.
    matrix : (n, n) float64
        ``F_ij``: share of the cosine-distributed rays from i that reach fronts of j.
    standard_error : (n, n) float64
        Standard error of each, or the estimated error of a quadrature.
    sky : (n,) float64
        ``F_i,sky``: share of the rays from each that reach the sky; 0 where there is none.
    sky_error : (n,) float64
        Its standard error.
    areas : (n,) float64
        Areas, the scene's units squared; both sides where both send and receive.
    closure : (n,) float64
        ``1 - sum_j F_ij - F_i,sky``: what each row is short of 1. It is 0 in a closed opaque scene.
    reciprocity : (n, n) float64
        ``(A_i F_ij - A_j F_ji)`` over the larger of the two; every direction is found by itself.
    how : (n, n) array of str
        ``"closed-form"``, ``"quadrature"`` or ``"rays"``.
    tolerance : float
        What was asked for.
    """

    names: list[str]
    matrix: Float64
    standard_error: Float64
    sky: Float64
    sky_error: Float64
    areas: Float64
    closure: Float64
    reciprocity: Float64
    how: npt.NDArray[np.str_]
    tolerance: float

    def to_pandas(self) -> pandas.DataFrame:
        """The matrix as a table; needs pandas.

        Returns
        -------
        pandas.DataFrame
            A row for each object that sends, the index ``from``; a column for each that receives, then ``sky`` and
            ``closure``, in scenes without a sky too. So each row sums to 1. Where an object has one of these names, the
            column's has an underscore behind it.
        """
        import pandas

        table = pandas.DataFrame(self.matrix, index=self.names, columns=self.names)
        table.index.name = "from"
        for name, values in (("sky", self.sky), ("closure", self.closure)):
            table[_unlike(name, self.names)] = values
        return table

    def __repr__(self) -> str:
        shown = ", ".join(self.names[:6]) + (", ..." if len(self.names) > 6 else "")
        return f"<halflight.Factors: {len(self.names)} objects ({shown}){', sky' if self.sky.any() else ''}>"

    def _repr_html_(self) -> str:
        return _show.factors(self.names, self.matrix, [("sky", self.sky), ("closure", self.closure)])


def _unlike(name: str, names: list[str]) -> str:
    while name in names:
        name += "_"
    return name


class PatchFactors(Fixed):
    """Form factors between the n patches of surfaces, all rows and columns, found by rays.

    Attributes
    ----------
    names : list of str
        The scene's objects.
    residual : float
        Reciprocity of all rows together: RMS of ``A_i F_ij - A_j F_ji`` over that of ``A_i F_ij``.
    rays : int
        Rays cast.
    """

    _instead = "find others: halflight.patch_factors(scene, ...)"

    def __init__(self, found: _native.Between, names: list[str]) -> None:
        n = found.solid()
        self._rows = (found.starts(), *found.factors())
        self._sky, self._closure, self._reciprocity = (share[:n] for share in found.shares())
        self._areas, self._objects = found.areas()[:n], found.objects()[:n]
        self._centres, self._normals = (place[:n] for place in found.places())
        self.names = names
        self.residual, self.rays = found.taken()
        self._fix()

    def __len__(self) -> int:
        return len(self._areas)

    @property
    def matrix(self) -> scipy.sparse.csr_array:
        """F as SciPy's CSR matrix (n, n), float32, over the memory that halflight has it in; needs scipy.

        Under a sky it is a copy without the sky's columns, which ``sky`` is the sum of.
        """
        n, all_of_them = len(self), len(self._rows[0]) - 1
        whole = sparse(self._rows, all_of_them)
        return whole if n == all_of_them else whole[:n, :n]

    @property
    def centres(self) -> Float64:
        """Middles of the patches, the scene's units, (n, 3) float64."""
        return cast("Float64", self._centres)

    @property
    def normals(self) -> npt.NDArray[np.float32]:
        """Unit normals, (n, 3) float32."""
        return cast("npt.NDArray[np.float32]", self._normals)

    @property
    def sky(self) -> npt.NDArray[np.float32]:
        """Share of each patch's rays that reach the sky, (n,) float32; a view."""
        return cast("npt.NDArray[np.float32]", self._sky)

    @property
    def closure(self) -> npt.NDArray[np.float32]:
        """``1 - sum_j F_ij - F_i,sky``: what each row is short of 1, (n,) float32; a view."""
        return cast("npt.NDArray[np.float32]", self._closure)

    @property
    def reciprocity(self) -> npt.NDArray[np.float32]:
        """Residual of each row, (n,) float32; a view."""
        return cast("npt.NDArray[np.float32]", self._reciprocity)

    @property
    def areas(self) -> Float64:
        """Areas, the scene's units squared, (n,) float64; a view."""
        return cast("Float64", self._areas)

    @property
    def objects(self) -> npt.NDArray[np.uint32]:
        """Number in ``names`` of each patch's object, (n,) uint32; a view."""
        return cast("npt.NDArray[np.uint32]", self._objects)

    def __repr__(self) -> str:
        return f"<halflight.PatchFactors: {len(self)} patches, residual {100 * self.residual:.2f} %>"


def _tau(scene: Scene, tau: Any) -> float:
    own = scene.transport
    return (own[1] if own else 0.0) if tau is None else arguments.real("tau", tau, 0.0, 1.0)


def factors(
    scene: Scene,
    *,
    tolerance: float = 1e-4,
    tau: float | None = None,
    seed: int = 0,
    progress: bool | Callable[[str, int, int], object] | None = None,
) -> Factors:
    """Form factors between the objects of a scene, in double precision where closed forms and quadratures reach.

    Parameters
    ----------
    scene : Scene
        It needs neither light nor camera.
    tolerance : float
        Error allowed as a share of each form factor; a thousandth of it is allowed to any.
    tau : float, optional
        Transmission, 0 to 1, of materials without their own; the scene file's, or 0.
    seed, progress
        As in :func:`render`.

    Returns
    -------
    Factors
        Names, matrix, standard errors, the sky's column, closure and reciprocity.

    Warns
    -----
    ToleranceWarning
        Some have a standard error above the tolerance: the rays ran out.

    Examples
    --------
    >>> import halflight as hl
    >>> F = hl.factors(hl.load("concentric-spheres"), tolerance=0.01)
    >>> bool(abs(F.closure).max() < 0.01)
    True
    """
    own = native_of(scene)
    aim = arguments.real("tolerance", tolerance, 0.0, 1.0, open_below=True)
    asked = arguments.run(seed, None, progress)
    found = _native.object_factors(own, _tau(scene, tau), aim, asked)
    rows, columns = found.names()
    matrix, errors = found.matrix()
    n = len(rows)
    if found.unmet() > 0:
        warnings.warn(
            f"{found.unmet()} of {matrix.size} form factors have a standard error above the tolerance: "
            "the rays ran out",
            ToleranceWarning,
            stacklevel=2,
        )
    has_sky = len(columns) > n
    areas, closure = found.rows()
    return Factors(
        rows,
        np.ascontiguousarray(matrix[:, :n]),
        np.ascontiguousarray(errors[:, :n]),
        matrix[:, n].copy() if has_sky else np.zeros(n),
        errors[:, n].copy() if has_sky else np.zeros(n),
        areas,
        closure,
        found.reciprocity(),
        np.array(found.how()).reshape(matrix.shape)[:, :n],
        aim,
    )


def patch_factors(
    scene: Scene,
    *,
    patches: int = 4000,
    rays: int = 256,
    tau: float | None = None,
    seed: int = 0,
    memory: float | None = None,
    progress: bool | Callable[[str, int, int], object] | None = None,
) -> PatchFactors:
    """Form factors between patches, by rays.

    Parameters
    ----------
    scene : Scene
        It needs neither light nor camera.
    patches, rays : int
        About how many patches, and hemisphere rays from each.
    tau, seed, memory, progress
        As in :func:`factors` and :func:`render`.

    Returns
    -------
    PatchFactors
        F as a sparse matrix, the sky's column, closure and reciprocity.

    Raises
    ------
    DoesNotFit
        F would not fit in memory; ``.fitting`` patches would.
    """
    own = native_of(scene)
    fineness = arguments.fineness(patches, rays)
    asked = arguments.run(seed, memory, progress)
    return PatchFactors(_native.patch_factors(own, _tau(scene, tau), fineness, asked), scene.objects)
