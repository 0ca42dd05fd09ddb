"""Solutions of L = E + K L on patches, with all bounces apart."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native, _plots, _points, _show
from halflight._bounces import Bounces
from halflight._camera import Camera
from halflight._fixed import Fixed
from halflight._kept import Kept, assembled_again, kept
from halflight._patches import Patches
from halflight._picture import Picture, Seconds, made
from halflight._render import warn_of_backs
from halflight._scene import Scene

if TYPE_CHECKING:
    import pyvista
    from matplotlib.axes import Axes

    from halflight._operator import Operator

__all__ = ["Solution", "Summing", "ToTolerance", "solved", "walked"]

Float32 = npt.NDArray[np.float32]
Progress = bool | Callable[[str, int, int], object] | None


@dataclass(frozen=True)
class Summing:
    """How a series is summed: so many bounces, or until a truncation; and how many terms are kept."""

    bounces: int | None
    truncation: float
    keep: int


@dataclass(frozen=True)
class ToTolerance:
    """How terms were measured to a tolerance."""

    count: int
    transport: tuple[float, float]
    aim: tuple[float, float | None]
    apart: bool
    seed: int


How = Summing | ToTolerance


class Solution(Fixed):
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

    _instead = "solve again: halflight.solve(scene, ...)"

    def __init__(self, scene: Scene, system: _native.System, series: _native.Series, how: How) -> None:
        self.scene = scene
        self._system = system
        self._series = series
        self._how = how
        (self.alpha, self.tau), self._fineness, self._seed, _ = system.recipe()
        lower, upper, self.verdict = series.verdict()
        self.radius = (lower, upper)
        self.truncation = series.truncation()
        self.luminaires = {name: np.array(powers) for name, powers, _ in series.luminaires()}
        self._fix()

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
        """K, which SciPy's solvers take as it is."""
        from halflight._operator import Operator

        return Operator(self._system)

    @property
    def closure(self) -> tuple[float, float, float] | None:
        """Mean by area, least and largest closure of the patches that rays were cast from.

        ``closure_i = 1 - sum_j F_ij``: what a row is short of 1, as everywhere here. It is 0 in a closed opaque scene,
        1 on faces inside of solids, which see nothing, and below 0 where surfaces transmit. ``None`` where no ray was
        needed.
        """
        sums = self._system.row_sums()
        return None if sums is None else (1.0 - sums[0], 1.0 - sums[2], 1.0 - sums[1])

    def points(
        self,
        xyz: npt.ArrayLike,
        normals: npt.ArrayLike,
        *,
        tolerance: float = 0.01,
        per: Literal["luminaire"] | None = None,
        seed: int | None = None,
        memory: float | None = None,
        progress: Progress = None,
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
        camera: Camera | str | None = None,
        *,
        size: tuple[int, int] = (512, 512),
        samples: int = 128,
        seed: int | None = None,
        memory: float | None = None,
        progress: Progress = None,
    ) -> Picture:
        """A picture of L by any camera, gathered from the light on patches: no row of F is cast for it.

        Parameters
        ----------
        camera : Camera or str, optional
            Where it is taken from, or the name of one of ``scene.cameras``; the scene's own where it is left out.
        size : (int, int)
            Width and height in pixels.
        samples : int
            Hemisphere rays for each pixel.
        seed, memory, progress
            As in :func:`render`; the seed is the solution's where it is left out.

        Returns
        -------
        Picture
            (height, width, 3) float32, linear radiance of the visible half, W/(m² sr). Its ``error`` is not estimated,
            its ``rays`` are those of this picture alone, its ``standard_error`` is that of its rays.

        Raises
        ------
        DoesNotFit
            The picture would not fit in memory.
        """
        pixels = arguments.pixels(size, samples)
        asked = arguments.run(self._seed if seed is None else seed, memory, progress)
        seen = self._seen_by(camera)
        start = time.perf_counter()
        found, standard_error, rays, backs = _native.solution_picture(self._system, self._series, seen, pixels, asked)
        seconds = time.perf_counter() - start
        warn_of_backs(backs, 3)
        return made(
            found,
            standard_error=standard_error,
            radius=self.radius,
            verdict=self.verdict,
            seconds=Seconds(0.0, 0.0, 0.0, seconds, seconds),
            patches=len(self.patches),
            rays=rays,
        )

    def pictures(
        self,
        count: int | None = None,
        camera: Camera | str | None = None,
        *,
        size: tuple[int, int] = (256, 256),
        samples: int = 128,
        seed: int | None = None,
        memory: float | None = None,
        progress: Progress = None,
    ) -> Float32:
        """Pictures of E and of the first bounces, from the same rays.

        Parameters
        ----------
        count : int, optional
            Bounces, E not counted; all that the solution has kept.
        camera, size, samples
            As in :meth:`picture`.
        seed, memory, progress
            As in :meth:`picture`.

        Returns
        -------
        (1 + count, height, width, 3) float32
            Linear radiance of the visible half of each term, W/(m² sr). Fewer where the series ends.

        Raises
        ------
        DoesNotFit
            The pictures would not fit in memory.
        """
        most = self.bounces.kept - 1
        wanted = most if count is None else arguments.integer("count", count, 0, most)
        asked = arguments.run(self._seed if seed is None else seed, memory, progress)
        pixels, seen = arguments.pixels(size, samples), self._seen_by(camera)
        return np.stack(_native.term_pictures(self._system, self._series, wanted, seen, pixels, asked))

    def _seen_by(self, camera: Any) -> _native.Scene:
        """The scene behind a camera."""
        return self.scene._held if camera is None else self.scene.with_camera(camera)._held

    def save(
        self,
        folder: str | os.PathLike[str],
        *,
        also: Sequence[Literal["ply", "mtx"]] = (),
        progress: Progress = None,
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
        ValueError
            Some terms were not kept: a folder has all of them.
        """
        if self.bounces.kept < len(self.bounces):
            raise ValueError(
                f"a folder has all {len(self.bounces)} terms, and {self.bounces.kept} were kept: solve without keep"
            )
        kinds = arguments.choices("also", also, ["ply", "mtx"])
        asked = arguments.run(self._seed, None, progress)
        _native.save_folder(self._system, self._series, arguments.path("folder", folder), kinds, asked)

    def plot_bounces(self, ax: Axes | None = None) -> Axes:
        """Norms of the terms and the proved bounds on what follows, over n; needs matplotlib.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; new ones where they are left out.

        Returns
        -------
        matplotlib.axes.Axes
        """
        return _plots.bounces([self._curve()], ax)

    def _curve(self) -> _plots.Curve:
        terms = self.bounces
        label = f"{self.scene.name}, {self._system.label()}: {self.verdict}"
        return _plots.Curve(label, terms.norm, terms.tail_bound)

    def to_pyvista(self) -> pyvista.PolyData:
        """The patches as a mesh for pyvista.

        Returns
        -------
        pyvista.PolyData
            Triangles with cell data: ``L``, ``L_invisible``, ``bounce_n`` of each term that is kept (visible half),
            ``rho``, ``alpha``, ``area``, ``material``, ``object`` and ``patch``.
        """
        patches = self.patches
        return cast("pyvista.PolyData", _plots.mesh(patches.triangles, self._cells(patches)))

    def _cells(self, patches: Patches) -> Iterator[tuple[str, npt.NDArray[Any]]]:
        """What a mesh has on its triangles, by name; made one after the other."""
        light = self.light
        yield "L", patches.on_triangles(light[:, 1])
        yield "L_invisible", patches.on_triangles(light[:, 0])
        for bounce in self.bounces[: self.bounces.kept]:
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
        if isinstance(self._how, ToTolerance):
            return (walked, (self.scene, self._how))
        return (_solution_again, (self.scene, kept(self._system), self._how))

    def __copy__(self) -> Solution:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Solution:
        return self


def solved(scene: Scene, system: _native.System, how: Summing) -> Solution:
    """An equation's series, summed."""
    if how.bounces is not None:
        series = _native.first_terms(system, how.bounces, how.keep)
    else:
        series = _native.summed(system, how.truncation, how.keep)
    return Solution(scene, system, series, how)


def walked(scene: Scene, how: ToTolerance, memory: Any = None, progress: Any = None) -> Solution:
    """Terms with their powers measured to a tolerance."""
    asked = arguments.run(how.seed, memory, progress)
    system, series = _native.bounces(scene._held, how.transport, how.count, how.aim, how.apart, asked)
    return Solution(scene, system, series, how)


def _solution_again(scene: Scene, own: Kept, how: Summing) -> Solution:
    return solved(scene, assembled_again(scene._held, own), how)
