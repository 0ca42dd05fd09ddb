"""Figures by matplotlib and meshes for pyvista, imported when they are asked for."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from halflight._map import StabilityMap
    from halflight._solution import Solution

__all__ = ["plot_bounces", "plot_map", "to_pyvista"]


def _figure(axes: Any, size: tuple[float, float]) -> tuple[Any, Any]:
    """A figure and its axes; those given, or new ones."""
    try:
        import matplotlib.figure
        from matplotlib.backends.backend_agg import FigureCanvasAgg
    except ImportError:
        raise ImportError("figures need matplotlib: pip install matplotlib") from None
    if axes is not None:
        return axes.figure, axes

    class Figure(matplotlib.figure.Figure):
        """A figure that notebooks show, whether or not pyplot is imported; it is closed by itself."""

        def _repr_png_(self) -> bytes:
            held = io.BytesIO()
            self.savefig(held, format="png")
            return held.getvalue()

    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.add_subplot()


def bounces(solutions: Sequence[Solution], axes: Any = None) -> Any:
    """Norms of the terms and the proved bounds on what follows each, over n."""
    figure, own = _figure(axes, (7.0, 4.4))
    for k, solution in enumerate(solutions):
        terms = solution.bounces
        n, colour = np.arange(len(terms)), f"C{k}"
        label = f"{solution.scene.name}, {solution._system.label()}: {solution.verdict}"
        seen = terms.norm > 0.0
        own.semilogy(n[seen], terms.norm[seen], "o-", color=colour, ms=4, label=label)
        bounded = terms.tail_bound > 0.0
        if bounded.any():
            own.semilogy(n[bounded], terms.tail_bound[bounded], "--", color=colour, lw=1.2)
    own.plot([], [], "--", color="0.4", lw=1.2, label="proved bound on all later terms")
    own.set_xlabel("bounce n")
    own.set_ylabel("norm of KⁿE, W/(m² sr)")
    own.xaxis.get_major_locator().set_params(integer=True)
    own.grid(True, which="major", color="0.9")
    own.set_axisbelow(True)
    own.spines[["top", "right"]].set_visible(False)
    own.legend(frameon=False, fontsize="small")
    return figure


def stability(own: StabilityMap, axes: Any = None) -> Any:
    """The spectral radius over the square, with both frontiers."""
    figure, ax = _figure(axes, (6.0, 5.0))
    middle = 0.5 * (own.lower + own.upper)
    shown = ax.pcolormesh(own.tau, own.alpha, middle, cmap="viridis", shading="gouraud", vmin=0.0)
    figure.colorbar(shown, ax=ax, label="spectral radius of K")
    levels = [level for level in (0.25, 0.5, 0.75) if level < middle.max()]
    if levels:
        lines = ax.contour(own.tau, own.alpha, middle, levels, colors="white", linewidths=0.7)
        ax.clabel(lines, fmt="%.2f", fontsize="x-small")
    for points, style, label in [
        (own.frontier, "-", "above: the series diverges"),
        (own.variance_frontier, "--", "above: a path tracer's variance is infinite"),
    ]:
        if len(points):
            ax.plot(points[:, 0], points[:, 1], style, color="white", lw=3.2)
            ax.plot(points[:, 0], points[:, 1], style, color="black", lw=1.6, label=label)
    ax.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0), xlabel="tau, transmission", ylabel="alpha, interreflection")
    ax.set_title(own.name, fontsize="medium")
    if any(len(points) and points[:, 1].min() < 1.0 for points in (own.frontier, own.variance_frontier)):
        ax.legend(loc="lower left", fontsize="small", framealpha=0.9)
    return figure


def mesh(solution: Solution) -> Any:
    """The patches as pyvista's mesh, with the light of every bounce on their triangles."""
    try:
        import pyvista
    except ImportError:
        raise ImportError("meshes need pyvista: pip install pyvista") from None
    patches = solution.patches
    corners, owner = patches.triangles, patches.triangle_patch
    count = len(corners)
    faces = np.column_stack([np.full(count, 3), np.arange(3 * count).reshape(count, 3)])
    made = pyvista.PolyData(corners.reshape(-1, 3), faces.ravel())

    def put(name: str, values: npt.NDArray[Any]) -> None:
        made.cell_data[name] = patches.on_triangles(values)

    put("L", solution.light[:, 1])
    put("L_invisible", solution.light[:, 0])
    for bounce in solution.bounces:
        put(f"bounce_{bounce.n}", bounce.light[:, 1])
    put("rho", patches.rho)
    put("alpha", patches.alpha)
    put("area", patches.areas)
    put("material", patches.materials)
    put("object", patches.objects)
    made.cell_data["patch"] = owner
    made.set_active_scalars("L", preference="cell")
    return made


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
    from halflight._solution import Solution

    for k, solution in enumerate(solutions):
        if not isinstance(solution, Solution):
            raise TypeError(f"solutions[{k}] must be a halflight.Solution, not {solution!r}")
    if not solutions:
        raise TypeError("give one solution or several")
    return bounces(solutions, axes)


def plot_map(stability_map: StabilityMap, axes: Any = None) -> Any:
    """A stability map with both frontiers; needs matplotlib. See :meth:`StabilityMap.plot`."""
    from halflight._map import StabilityMap

    if not isinstance(stability_map, StabilityMap):
        raise TypeError(f"stability_map must be a halflight.StabilityMap, not {stability_map!r}")
    return stability(stability_map, axes)


def to_pyvista(solution: Solution) -> Any:
    """The patches of a solution as a mesh for pyvista. See :meth:`Solution.to_pyvista`."""
    from halflight._solution import Solution

    if not isinstance(solution, Solution):
        raise TypeError(f"solution must be a halflight.Solution, not {solution!r}")
    return mesh(solution)
