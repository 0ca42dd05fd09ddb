"""Solutions of L = E + K L on patches: all bounces apart, luminaire by luminaire, and as folders."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, cast, overload

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native, _plots, _points, _show
from halflight._errors import ToleranceWarning
from halflight._kept import Kept, assembled_again, kept
from halflight._operator import Operator, Patches
from halflight._picture import factors_of, of
from halflight._scene import Scene

if TYPE_CHECKING:
    import matplotlib.figure
    import pyvista

__all__ = ["Bounce", "Bounces", "Lamps", "Solution", "bounces", "open", "solve"]

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]


@dataclass(frozen=True, repr=False, eq=False)
class Bounce:
    """A term of the series: light that was reflected n times.

    Attributes
    ----------
    n : int
        Number of reflections.
    light : (patches, 2, 3) float32
        ``KⁿE``, W/(m² sr): invisible and visible half; red, green, blue; a view.
    power, power_invisible : (3,) float64
        Power of each half per channel, W: pi times the sum of area times light.
    norm : float
        Area-weighted RMS over patches, channels and halves, W/(m² sr).
    ratio : float
        The norm over that of the term before; NaN for n = 0.
    tail_bound : float
        Proved bound on the norm of all later terms together; NaN where there is none.
    error : float
        Relative standard error of the power where walks of light measured it (:func:`bounces`); NaN elsewhere.
    """

    n: int
    light: Float32
    power: Float64
    power_invisible: Float64
    norm: float
    ratio: float
    tail_bound: float
    error: float

    def __repr__(self) -> str:
        red, green, blue = self.power
        tail = f"all later at most {self.tail_bound:.3g}"
        return f"<halflight.Bounce {self.n}: {red:.4g}, {green:.4g}, {blue:.4g} W, {tail}>"


class Bounces(Sequence[Bounce]):
    """The terms E, KE, K²E, ... of a series; their figures are arrays over n.

    ``bounces[2].light`` is K²E on the patches.
    """

    def __init__(self, solution: Solution) -> None:
        self._solution = solution
        series = self._series = solution._series
        self._power, self._power_invisible = series.powers()
        self._figures = np.array(series.figures()).reshape(-1, 3)
        errors = series.errors()
        self._error = np.array(errors) if errors else np.full(len(self._figures), np.nan)
        for numbers in (self._power, self._power_invisible, self._figures, self._error):
            numbers.flags.writeable = False

    def __len__(self) -> int:
        return len(self._figures)

    @overload
    def __getitem__(self, n: int) -> Bounce: ...
    @overload
    def __getitem__(self, n: slice) -> list[Bounce]: ...
    def __getitem__(self, n: int | slice) -> Bounce | list[Bounce]:
        if isinstance(n, slice):
            return [self._one(k) for k in range(*n.indices(len(self)))]
        k = n + len(self) if n < 0 else n
        if not 0 <= k < len(self):
            raise IndexError(f"there are bounces 0 to {len(self) - 1}, and {n} is none of them")
        return self._one(k)

    def _one(self, n: int) -> Bounce:
        norm, ratio, tail = (float(x) for x in self._figures[n])
        error = float(self._error[n])
        return Bounce(n, self._series.term(n), self._power[n], self._power_invisible[n], norm, ratio, tail, error)

    def __iter__(self) -> Iterator[Bounce]:
        return (self._one(n) for n in range(len(self)))

    @property
    def power(self) -> Float64:
        """Power of the visible half of each term per channel, W, (terms, 3)."""
        return cast("Float64", self._power)

    @property
    def power_invisible(self) -> Float64:
        """Power of the invisible half of each term per channel, W, (terms, 3)."""
        return cast("Float64", self._power_invisible)

    @property
    def norm(self) -> Float64:
        """Norm of each term, W/(m² sr), (terms,)."""
        return self._figures[:, 0]

    @property
    def ratio(self) -> Float64:
        """Norm of each term over that of the one before, (terms,)."""
        return self._figures[:, 1]

    @property
    def tail_bound(self) -> Float64:
        """Proved bound on the norm of all that follows each term, (terms,); NaN where there is none."""
        return self._figures[:, 2]

    @property
    def error(self) -> Float64:
        """Relative standard error of each power, (terms,); NaN where it was not measured."""
        return self._error

    def __repr__(self) -> str:
        return f"<halflight.Bounces: E and {len(self) - 1} bounces>"

    def __reduce__(self) -> tuple[Any, ...]:
        return (Bounces, (self._solution,))


class Solution:
    """L = E + K L on the patches of a scene, with every bounce apart.

    Attributes
    ----------
    scene : Scene
    alpha, tau : float
        What was solved for.
    radius : (float, float)
        Proved bounds on the spectral radius of K on what light reaches.
    verdict : {"converges", "ends", "diverges", "undecided"}
        How the series behaves; all but the last are proved.
    truncation : float
        What the series left out at most, as a share of the reflected light.
    luminaires : dict of str to (terms, 3) float64
        Power of each luminaire's terms, W, of :func:`bounces` with ``per="luminaire"``.
    """

    def __init__(self, scene: Scene, system: _native.System, series: _native.Series, how: tuple[str, Any]) -> None:
        self.scene = scene
        self._system = system
        self._series = series
        self._how = how
        (self.alpha, self.tau), self._fineness, self._seed, _ = system.recipe()
        lower, upper, self.verdict = series.verdict()
        self.radius = (lower, upper)
        self.truncation = series.truncation()
        self.luminaires = {name: np.array(powers) for name, powers, _ in series.luminaires()}

    @property
    def bounces(self) -> Bounces:
        """The terms E, KE, K²E, ..."""
        return Bounces(self)

    @property
    def light(self) -> Float32:
        """L, (patches, 2, 3) float32, W/(m² sr): invisible and visible half; red, green, blue; a view."""
        return cast("Float32", self._series.light())

    @property
    def left(self) -> Float32 | None:
        """Proved bound on what the series left out, patch by patch, (patches, 2, 3) float32; ``None`` without one."""
        return self._series.left()

    @property
    def patches(self) -> Patches:
        """Where the patches are, and what they are made of."""
        return Patches(self._system)

    @property
    def operator(self) -> Operator:
        """K."""
        return Operator(self._system)

    @property
    def closure(self) -> tuple[float, float, float] | None:
        """Mean, least and largest sum of the rows of F, 1 in a closed scene but on faces inside of solids, which see
        nothing; ``None`` where no ray was needed."""
        return self._system.closure()

    def points(
        self,
        xyz: npt.ArrayLike,
        normals: npt.ArrayLike,
        *,
        tolerance: float = 0.01,
        per: Literal["luminaire"] | None = None,
        seed: int | None = None,
        memory: float | None = None,
        progress: bool | Callable[[str, int, int], object] | None = None,
    ) -> _points.Irradiance:
        """The irradiance of the solution's mode at points; see :func:`halflight.points`, whose patches are its own."""
        return _points.measured(
            self.scene,
            xyz,
            normals,
            transport=(self.alpha, self.tau),
            tolerance=tolerance,
            per=per,
            seed=self._seed if seed is None else seed,
            memory=memory,
            progress=progress,
        )

    def picture(
        self,
        *,
        size: tuple[int, int] = (512, 512),
        samples: int = 128,
        seed: int | None = None,
        memory: float | None = None,
        progress: bool | Callable[[str, int, int], object] | None = None,
    ) -> Float32:
        """A picture of L from the scene's camera; its error is not estimated.

        Parameters
        ----------
        size : (int, int)
            Width and height in pixels.
        samples : int
            Hemisphere rays for each pixel.

        Returns
        -------
        (height, width, 3) float32
            Linear radiance of the visible half, W/(m² sr).
        """
        asked = arguments.run(self._seed if seed is None else seed, memory, progress)
        rays = arguments.integer("samples", samples, 1, arguments.MOST_RAYS)
        return cast("Float32", _native.solution_picture(self._system, self._series, arguments.size(size), rays, asked))

    def pictures(
        self,
        count: int | None = None,
        *,
        size: tuple[int, int] = (256, 256),
        samples: int = 128,
        seed: int | None = None,
        memory: float | None = None,
        progress: bool | Callable[[str, int, int], object] | None = None,
    ) -> Float32:
        """Pictures of E and of the first bounces, from the same rays.

        Parameters
        ----------
        count : int, optional
            Bounces, E not counted; all that the solution has.
        size, samples
            As in :meth:`picture`.

        Returns
        -------
        (1 + count, height, width, 3) float32
            Linear radiance of the visible half of each term, W/(m² sr). Fewer where the series ends.
        """
        most = len(self.bounces) - 1
        wanted = most if count is None else arguments.integer("count", count, 0, most)
        asked = arguments.run(self._seed if seed is None else seed, memory, progress)
        rays = arguments.integer("samples", samples, 1, arguments.MOST_RAYS)
        found = _native.term_pictures(self._system, self._series, wanted, arguments.size(size), rays, asked)
        return np.stack(found)

    def save(
        self,
        folder: str | os.PathLike[str],
        *,
        also: Sequence[Literal["ply", "mtx"]] = (),
        progress: bool | Callable[[str, int, int], object] | None = None,
    ) -> None:
        """Keeps F, L and all terms in a folder, byte by byte as the program's ``--save`` does.

        All rows and columns of F are kept, which takes its rays once more.

        Parameters
        ----------
        folder : str or path
            Made anew; one that an earlier run made is replaced, any other that is not empty is refused.
        also : sequence of {"ply", "mtx"}
            Files beyond those that every folder has: patches with colours, F as Matrix Market.

        Raises
        ------
        FolderError
            A folder that cannot be written, or is of something else.
        """
        kinds = arguments.choices("also", also, ["ply", "mtx"])
        asked = arguments.run(self._seed, None, progress)
        _native.save_folder(self._system, self._series, arguments.path("folder", folder), kinds, asked)

    def plot_bounces(self, axes: Any = None) -> matplotlib.figure.Figure:
        """Norms of the terms and the proved bounds on what follows, over n; needs matplotlib.

        Parameters
        ----------
        axes : matplotlib Axes, optional
            Where to draw.
        """
        return cast("matplotlib.figure.Figure", _plots.bounces([self._curve()], axes))

    def _curve(self) -> _plots.Curve:
        terms = self.bounces
        label = f"{self.scene.name}, {self._system.label()}: {self.verdict}"
        return _plots.Curve(label, terms.norm, terms.tail_bound)

    def to_pyvista(self) -> pyvista.PolyData:
        """The patches as a mesh for pyvista.

        Returns
        -------
        pyvista.PolyData
            Triangles with cell data: ``L``, ``L_invisible``, ``bounce_n`` of each term (visible half), ``rho``,
            ``alpha``, ``area``, ``material``, ``object`` and ``patch``.
        """
        patches = self.patches
        return cast("pyvista.PolyData", _plots.mesh(patches.triangles, self._cells(patches)))

    def _cells(self, patches: Patches) -> Iterator[tuple[str, npt.NDArray[Any]]]:
        """What a mesh has on its triangles, by name; made one after the other."""
        light = self.light
        yield "L", patches.on_triangles(light[:, 1])
        yield "L_invisible", patches.on_triangles(light[:, 0])
        for bounce in self.bounces:
            yield f"bounce_{bounce.n}", patches.on_triangles(bounce.light[:, 1])
        yield "rho", patches.on_triangles(patches.rho)
        yield "alpha", patches.on_triangles(patches.alpha)
        yield "area", patches.on_triangles(patches.areas)
        yield "material", patches.on_triangles(patches.materials)
        yield "object", patches.on_triangles(patches.objects)
        yield "patch", patches.triangle_patch

    def __repr__(self) -> str:
        lower, upper = self.radius
        return (
            f"<halflight.Solution {self.scene.name}, {self._system.label()}: {len(self.patches)} patches, "
            f"{len(self.bounces) - 1} bounces, {self.verdict}, spectral radius {lower:.4f} to {upper:.4f}>"
        )

    def _repr_html_(self) -> str:
        return _show.solution(self.bounces, repr(self).strip("<>"))

    def __reduce__(self) -> tuple[Any, ...]:
        if self._how[0] == "tolerance":
            return (_bounces_again, (self.scene, self._how[1]))
        return (_solution_again, (self.scene, kept(self._system), self._how))

    def __copy__(self) -> Solution:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Solution:
        return self


class Lamps:
    """L of each luminaire alone, over one K: light is linear in E, so that any mixture needs no further solve.

    Attributes
    ----------
    scene : Scene
    names : list of str
        The luminaires.
    light : (lamps, patches, 2, 3) float32
        L of each, W/(m² sr).
    rest : (lamps,) float64
        Proved bound on the norm of what is missing of each.
    radius : (float, float)
        Proved bounds on the spectral radius of K.
    verdict : str
        How the series behaves.
    """

    def __init__(self, scene: Scene, system: _native.System, found: _native.Lamps, truncation: float) -> None:
        self.scene = scene
        self._system = system
        self._truncation = truncation
        self.names: list[str] = system.luminaires()
        self.light: Float32 = found.light()
        self.light.flags.writeable = False
        self.rest: Float64 = np.array(found.rest())
        lower, upper, self.verdict = found.verdict()
        self.radius = (lower, upper)

    @property
    def shape(self) -> tuple[int, ...]:
        """(lamps, patches, 2, 3)."""
        return self.light.shape

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> npt.NDArray[Any]:
        if copy is False and dtype is not None and np.dtype(dtype) != self.light.dtype:
            raise ValueError("another type of numbers needs a copy")
        return np.array(self.light, dtype) if copy else np.asarray(self.light, dtype)

    def __len__(self) -> int:
        return len(self.names)

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def keys(self) -> list[str]:
        """The luminaires' names, so that ``dict(lamps)`` has L of each."""
        return list(self.names)

    def __getitem__(self, name: str) -> Float32:
        """L of the luminaire of a name, (patches, 2, 3) float32."""
        return cast(
            "Float32", self.light[self.names.index(arguments.choice("the name of a luminaire", name, self.names))]
        )

    def mix(self, luminaires: Mapping[str, Any]) -> Float32:
        """L with luminaires dimmed, brightened or coloured, without solving again.

        Parameters
        ----------
        luminaires : mapping of str to float or (3,) floats
            Factors by name, 0 or more; those that are not named stay as they are.

        Returns
        -------
        (patches, 2, 3) float32
            L, W/(m² sr).
        """
        factors = np.array(factors_of(luminaires, self.names), np.float32).reshape(-1, 3)
        mixed: Float32 = np.einsum("lphc,lc->phc", self.light, factors)
        return mixed

    @property
    def patches(self) -> Patches:
        """Where the patches are, and what they are made of."""
        return Patches(self._system)

    @property
    def operator(self) -> Operator:
        """K."""
        return Operator(self._system)

    def __repr__(self) -> str:
        return f"<halflight.Lamps {self.scene.name}: {', '.join(self.names)}; {len(self.patches)} patches>"

    def __reduce__(self) -> tuple[Any, ...]:
        return (_lamps_again, (self.scene, kept(self._system), self._truncation))

    def __copy__(self) -> Lamps:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Lamps:
        return self


def _solution_again(scene: Scene, own: Kept, how: tuple[str, Any]) -> Solution:
    return _solved(scene, assembled_again(scene._held, own), how)


def _lamps_again(scene: Scene, own: Kept, truncation: float) -> Lamps:
    system = assembled_again(scene._held, own)
    return Lamps(scene, system, _native.lamps(system, truncation), truncation)


def _bounces_again(scene: Scene, asked: dict[str, Any]) -> Solution:
    return bounces(scene, **asked)


def _solved(scene: Scene, system: _native.System, how: tuple[str, Any]) -> Solution:
    kind, number = how
    series = _native.first_terms(system, number) if kind == "bounces" else _native.summed(system, number)
    return Solution(scene, system, series, how)


@overload
def solve(
    scene: Scene,
    *,
    mode: arguments.Mode | None = None,
    alpha: float | None = None,
    tau: float | None = None,
    patches: int = 4000,
    rays: int = 256,
    bounces: int | None = None,
    truncation: float = 1e-4,
    per: None = None,
    seed: int = 0,
    memory: float | None = None,
    progress: bool | Callable[[str, int, int], object] | None = None,
) -> Solution: ...
@overload
def solve(
    scene: Scene,
    *,
    mode: arguments.Mode | None = None,
    alpha: float | None = None,
    tau: float | None = None,
    patches: int = 4000,
    rays: int = 256,
    bounces: None = None,
    truncation: float = 1e-4,
    per: Literal["luminaire"],
    seed: int = 0,
    memory: float | None = None,
    progress: bool | Callable[[str, int, int], object] | None = None,
) -> Lamps: ...
def solve(
    scene: Scene,
    *,
    mode: arguments.Mode | None = None,
    alpha: float | None = None,
    tau: float | None = None,
    patches: int = 4000,
    rays: int = 256,
    bounces: int | None = None,
    truncation: float = 1e-4,
    per: Literal["luminaire"] | None = None,
    seed: int = 0,
    memory: float | None = None,
    progress: bool | Callable[[str, int, int], object] | None = None,
) -> Solution | Lamps:
    """Solves L = E + K L on patches by its Neumann series.

    Parameters
    ----------
    scene : Scene
        The scene.
    mode, alpha, tau
        As in :func:`render`.
    patches, rays : int
        About how many patches, and hemisphere rays from each for F.
    bounces : int, optional
        So many bounces, whether the series converges or not; without a number it is summed to ``truncation``.
    truncation : float
        Proved bound on what the series leaves out, as a share of the reflected light.
    per : {"luminaire"}, optional
        Solve for each luminaire apart, over one K.
    seed, memory, progress
        As in :func:`render`.

    Returns
    -------
    Solution
        L, the terms KⁿE with their figures, K and the patches; :class:`Lamps` for ``per="luminaire"``.

    Raises
    ------
    Diverges
        The series is not proved to converge, and no number of bounces is given.
    DoesNotFit
        K would not fit in memory; ``.fitting`` patches would.

    Notes
    -----
    Errors of L by the size of patches and the noise of F are not estimated here: :func:`render`, :func:`bounces` and
    :func:`points` state theirs.

    Examples
    --------
    >>> import halflight as hl
    >>> box = hl.solve(hl.cornell_box(), patches=300, rays=64)
    >>> box.verdict, box.light.shape == (len(box.patches), 2, 3)
    ('converges', True)
    """
    own = of(scene)
    pair = arguments.transport(mode, alpha, tau, scene.transport)
    fineness = arguments.fineness(patches, rays)
    share = arguments.real("truncation", truncation, 1e-12, 1.0)
    count = None if bounces is None else arguments.integer("bounces", bounces, 1, 10_000)
    apart = arguments.per(per)
    if apart and count is not None:
        raise ValueError(
            'give either bounces or per="luminaire": bounces of single luminaires are of halflight.bounces'
        )
    asked = arguments.run(seed, memory, progress)
    if apart:
        own.require_emission()
    system = _native.assemble(own, pair, fineness, apart, asked)
    if apart:
        return Lamps(scene, system, _native.lamps(system, share), share)
    return _solved(scene, system, ("truncation", share) if count is None else ("bounces", count))


def bounces(
    scene: Scene,
    count: int = 8,
    *,
    mode: arguments.Mode | None = None,
    alpha: float | None = None,
    tau: float | None = None,
    tolerance: float = 0.01,
    time: float | None = None,
    per: Literal["luminaire"] | None = None,
    seed: int = 0,
    memory: float | None = None,
    progress: bool | Callable[[str, int, int], object] | None = None,
) -> Solution:
    """The terms of the bounce series with their powers to a tolerance, measured by walks of light.

    Parameters
    ----------
    scene : Scene
        The scene; something in it must emit.
    count : int
        Bounces, E not counted.
    mode, alpha, tau
        As in :func:`render`.
    tolerance : float
        Relative standard error of each term's power to aim at.
    time : float, optional
        Seconds of which walks take half at most. Patches, of which norms and bounds are, follow from the tolerance and
        are solved in any case: ask for a larger one where they take too long.
    per : {"luminaire"}, optional
        Measure each luminaire's terms too: ``luminaires`` of the result.
    seed, memory, progress
        As in :func:`render`.

    Returns
    -------
    Solution
        ``bounces.power`` and ``bounces.error`` are those of the walks; light, norms and bounds those of patches. A
        series that diverges is shown as far as ``count``.

    Raises
    ------
    DoesNotFit
        K would not fit in memory.

    Warns
    -----
    ToleranceWarning
        The error of a term is above the tolerance.
    """
    own = of(scene)
    pair = arguments.transport(mode, alpha, tau, scene.transport)
    terms = arguments.integer("count", count, 1, 1000)
    aim = arguments.real("tolerance", tolerance, 0.0, 1.0, open_below=True)
    seconds = None if time is None else arguments.real("time", time, 0.0, 1e9, open_below=True)
    apart = arguments.per(per)
    asked = arguments.run(seed, memory, progress)
    own.require_emission()
    system, series = _native.bounces(own, pair, terms, (aim, seconds), apart, asked)
    if (why := series.unmet()) is not None:
        warnings.warn(f"the tolerance of {100 * aim:g} % is not met: {why}", ToleranceWarning, stacklevel=2)
    again = dict(count=terms, alpha=pair[0], tau=pair[1], tolerance=aim, time=seconds, per=per, seed=asked.seed)
    return Solution(scene, system, series, ("tolerance", again))


def open(
    folder: str | os.PathLike[str],
    *,
    progress: bool | Callable[[str, int, int], object] | None = None,
) -> Solution:
    """Opens a folder that :meth:`Solution.save`, or ``--save`` of the program, made.

    No ray of F is cast: L is solved again from it, and scene, patches and light come out bit by bit as they were.
    Powers are those of patches, also where :func:`bounces` had measured them. A folder without light is solved.

    Parameters
    ----------
    folder : str or path
        The folder of one mode.
    progress
        As in :func:`render`.

    Returns
    -------
    Solution

    Raises
    ------
    FolderError
        A folder that is damaged, of another version, of several modes, or made to a tolerance.
    """
    asked = arguments.run(0, None, progress)
    native, system, count = _native.open_folder(arguments.path("folder", folder), asked)
    return _solved(Scene._of(native), system, ("truncation", 1e-4) if count is None else ("bounces", max(count, 1)))
