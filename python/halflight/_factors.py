"""Form factors: between the objects of a scene under their names, and between its patches."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
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

__all__ = ["Exchange", "Factors", "PatchFactors", "factors", "patch_factors"]

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

    def exchange(self, emissivities: Mapping[str, Any] | npt.ArrayLike) -> Exchange:
        """What the objects exchange by radiation, grey and diffuse, of one temperature each.

        Parameters
        ----------
        emissivities : mapping of str to float, or (n,) floats
            Above 0 and up to 1: by name, or in the order of ``names``.

        Returns
        -------
        Exchange
            Gebhart's factors, conductances and the matrix of the net-radiation method; the sky is black.

        Examples
        --------
        >>> import halflight as hl
        >>> found = hl.factors(hl.load("furnace")).exchange([0.8])
        >>> round(float(found.gebhart[0, 0]), 6), round(float(found.row_sums[0]), 6)
        (1.0, 1.0)
        """
        if isinstance(emissivities, Mapping):
            unknown = sorted(set(emissivities) - set(self.names))
            missing = [name for name in self.names if name not in emissivities]
            if unknown or missing:
                wrong = f"unknown: {', '.join(map(str, unknown))}" if unknown else f"missing: {', '.join(missing)}"
                raise ValueError(f"emissivities must have one number for each object; {wrong}")
            emissivities = [emissivities[name] for name in self.names]
        given = arguments.array("emissivities", emissivities, (len(self.names),))
        if not ((given > 0.0) & (given <= 1.0)).all():
            raise ValueError(f"emissivities must be above 0 and up to 1, not {given.min():g} to {given.max():g}")
        has_sky = bool(self.sky.any())
        matrix = np.column_stack([self.matrix, self.sky]) if has_sky else self.matrix
        (gebhart, conductances, net), (sums, reciprocity) = _native.exchange(
            np.ascontiguousarray(matrix, np.float64), list(self.areas), list(given)
        )
        columns = [*self.names, _unlike("sky", self.names)] if has_sky else list(self.names)
        return Exchange(self.names, columns, given, gebhart, conductances, net, np.array(sums), np.array(reciprocity))

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


@dataclass(frozen=True, repr=False, eq=False)
class Exchange:
    """What n objects exchange by radiation.

    Attributes
    ----------
    names, columns : list of str
        The objects; what absorbs: the objects and, where there is one, the sky.
    emissivities : (n,) float64
        Of the objects.
    gebhart : (n, columns) float64
        ``B_ij``: share of what i emits that j absorbs, straight or after any reflections.
    conductances : (n, columns) float64
        ``A_i eps_i B_ij``, the scene's units squared: power from i to j is that times ``sigma T_i**4``.
    net : (n, columns) float64
        ``Q = net @ (sigma T**4)`` is the net power that leaves each object.
    row_sums : (n,) float64
        Of ``gebhart``: 1 in a closed scene.
    reciprocity : (n,) float64
        Of each object the largest ``|G_ij - G_ji|`` over the larger of the two.
    """

    names: list[str]
    columns: list[str]
    emissivities: Float64
    gebhart: Float64
    conductances: Float64
    net: Float64
    row_sums: Float64
    reciprocity: Float64

    def to_pandas(self) -> pandas.DataFrame:
        """The conductances as a table: a row for each object that emits; needs pandas."""
        import pandas

        table = pandas.DataFrame(self.conductances, index=self.names, columns=self.columns)
        table.index.name = "from"
        return table

    def __repr__(self) -> str:
        return f"<halflight.Exchange: {len(self.names)} objects, rows sum to {self.row_sums.min():.6g} at least>"


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
