"""Axes and meshes as functions, which check what they are given."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from halflight import _plots
from halflight._map import StabilityMap
from halflight._solution import Solution

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["plot_bounces", "plot_map", "to_pyvista"]


def plot_bounces(*solutions: Solution, ax: Axes | None = None) -> Axes:
    """Norms of the terms of one or several solutions, with the proved bounds on what follows; needs matplotlib.

    Parameters
    ----------
    *solutions : Solution
        What is drawn, a line each.
    ax : matplotlib Axes, optional
        Where to draw; new ones where they are left out.

    Returns
    -------
    matplotlib.axes.Axes
    """
    for k, solution in enumerate(solutions):
        if not isinstance(solution, Solution):
            raise TypeError(f"solutions[{k}] must be a halflight.Solution, not {solution!r}")
    if not solutions:
        raise TypeError("give one solution or several")
    return _plots.bounces([solution._curve() for solution in solutions], ax)


def plot_map(stability_map: StabilityMap, ax: Axes | None = None) -> Axes:
    """A stability map with both frontiers; needs matplotlib. See :meth:`StabilityMap.plot`."""
    if not isinstance(stability_map, StabilityMap):
        raise TypeError(f"stability_map must be a halflight.StabilityMap, not {stability_map!r}")
    return _plots.stability(stability_map, ax)


def to_pyvista(solution: Solution) -> Any:
    """The patches of a solution as a mesh for pyvista. See :meth:`Solution.to_pyvista`."""
    if not isinstance(solution, Solution):
        raise TypeError(f"solution must be a halflight.Solution, not {solution!r}")
    return solution.to_pyvista()
