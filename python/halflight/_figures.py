"""Figures and meshes as functions, which check what they are given."""

from __future__ import annotations

from typing import Any

from halflight import _plots
from halflight._map import StabilityMap
from halflight._solution import Solution

__all__ = ["plot_bounces", "plot_map", "to_pyvista"]


def plot_bounces(*solutions: Solution, axes: Any = None) -> Any:
    """Norms of the terms of one or several solutions, with the proved bounds on what follows; needs matplotlib.

    Parameters
    ----------
    *solutions : Solution
        What is drawn, a line each.
    axes : matplotlib Axes, optional
        Where to draw.

    Returns
    -------
    matplotlib.figure.Figure
    """
    for k, solution in enumerate(solutions):
        if not isinstance(solution, Solution):
            raise TypeError(f"solutions[{k}] must be a halflight.Solution, not {solution!r}")
    if not solutions:
        raise TypeError("give one solution or several")
    return _plots.bounces([solution._curve() for solution in solutions], axes)


def plot_map(stability_map: StabilityMap, axes: Any = None) -> Any:
    """A stability map with both frontiers; needs matplotlib. See :meth:`StabilityMap.plot`."""
    if not isinstance(stability_map, StabilityMap):
        raise TypeError(f"stability_map must be a halflight.StabilityMap, not {stability_map!r}")
    return _plots.stability(stability_map, axes)


def to_pyvista(solution: Solution) -> Any:
    """The patches of a solution as a mesh for pyvista. See :meth:`Solution.to_pyvista`."""
    if not isinstance(solution, Solution):
        raise TypeError(f"solution must be a halflight.Solution, not {solution!r}")
    return solution.to_pyvista()
