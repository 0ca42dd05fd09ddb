"""The stability map: where the bounce series converges, over the (alpha, tau) square."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native, _plots
from halflight._scene import Scene, native_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["StabilityMap", "stability_map"]

Float64 = npt.NDArray[np.float64]


@dataclass(frozen=True, repr=False, eq=False)
class StabilityMap:
    """Proved bounds on the spectral radius over the (alpha, tau) square, and its frontiers.

    The square lies as in the program's charts, alpha to the right and tau upwards: ``lower[t, a]`` is at ``tau[t]`` and
    ``alpha[a]``, so that axis 0 is tau and axis 1 alpha, as ``pcolormesh(alpha, tau, lower)`` and
    ``imshow(lower, origin="lower")`` have them.

    Attributes
    ----------
    name : str
        The scene.
    alpha, tau : (g,) float64
        The grid from 0 to 1: factors on every alpha, and tau.
    lower, upper : (g, g) float64
        Proved bounds on the spectral radius at (tau, alpha): axis 0 is tau, axis 1 alpha.
    frontier : (k, 4) float64
        A row for each tau: tau, alpha_c, its lower and its upper bound. The series diverges for alpha above alpha_c,
        to the right of it; above 1 it lies outside of the square.
    variance_frontier : (k, 4) float64
        The same for the alpha above which the variance of a path tracer is infinite.
    tau_frontier : (m, 4) float64
        alpha, tau_c, and bounds on the spectral radius there, for every alpha of the grid that has one.
    variance_exact : bool
        Whether ``variance_frontier`` is exact, or only proved to be no higher than the true one.
    patches, rays, crossings : int
        What it took.
    """

    name: str
    alpha: Float64
    tau: Float64
    lower: Float64
    upper: Float64
    frontier: Float64
    variance_frontier: Float64
    tau_frontier: Float64
    variance_exact: bool
    patches: int
    rays: int
    crossings: int

    def plot(self, ax: Axes | None = None) -> Axes:
        """The map with both frontiers, alpha to the right and tau upwards; needs matplotlib.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; new ones where they are left out.

        Returns
        -------
        matplotlib.axes.Axes
        """
        return _plots.stability(self, ax)

    def __repr__(self) -> str:
        g = len(self.alpha)
        return f"<halflight.StabilityMap {self.name}: {g}x{g}, spectral radius at most {self.upper.max():.4f}>"


def stability_map(
    scene: Scene,
    *,
    grid: int = 21,
    patches: int = 4000,
    rays: int = 256,
    seed: int = 0,
    memory: float | None = None,
    progress: bool | Callable[[str, int, int], object] | None = None,
) -> StabilityMap:
    """Maps the spectral radius of K over the (alpha, tau) square, from one cast of rays.

    Parameters
    ----------
    scene : Scene
        It need not emit.
    grid : int
        Points each way, 2 or more.
    patches, rays : int
        About how many patches, and hemisphere rays from each.
    seed, memory, progress
        As in :func:`render`.

    Returns
    -------
    StabilityMap

    Raises
    ------
    DoesNotFit
        The crossings of all rays would not fit in memory.
    """
    own = native_of(scene)
    steps = arguments.integer("grid", grid, 2, 1001)
    count, cast = arguments.fineness(patches, rays)
    asked = arguments.run(seed, memory, progress)
    columns, frontier, variance, of_alpha, exact, counts = _native.stability_map(own, steps, count, cast, asked)
    table = np.array(columns)
    # As the program has them: steps of alpha times the bounds at alpha 1.
    alpha = np.arange(steps) / (steps - 1)
    return StabilityMap(
        scene.name,
        alpha,
        table[:, 0],
        table[:, 1, None] * alpha,
        table[:, 2, None] * alpha,
        np.array(frontier).reshape(-1, 4),
        np.array(variance).reshape(-1, 4),
        np.array(of_alpha).reshape(-1, 4),
        exact,
        *counts,
    )
