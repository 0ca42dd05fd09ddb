"""Figures by matplotlib and meshes for pyvista, imported when they are asked for."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

__all__ = ["Curve", "Map", "bounces", "mesh", "stability"]

Float64 = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Curve:
    """A series over n: norms of its terms, and the proved bounds on all that follows each."""

    label: str
    norm: Float64
    tail_bound: Float64


class Map(Protocol):
    """What is drawn of a stability map; its attributes are those of :class:`halflight.StabilityMap`."""

    @property
    def name(self) -> str: ...
    @property
    def alpha(self) -> Float64: ...
    @property
    def tau(self) -> Float64: ...
    @property
    def lower(self) -> Float64: ...
    @property
    def upper(self) -> Float64: ...
    @property
    def frontier(self) -> Float64: ...
    @property
    def variance_frontier(self) -> Float64: ...


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


def bounces(curves: Sequence[Curve], axes: Any = None) -> Any:
    """Norms of the terms and the proved bounds on what follows each, over n."""
    figure, own = _figure(axes, (7.0, 4.4))
    for k, curve in enumerate(curves):
        n, colour = np.arange(len(curve.norm)), f"C{k}"
        seen = curve.norm > 0.0
        own.semilogy(n[seen], curve.norm[seen], "o-", color=colour, ms=4, label=curve.label)
        bounded = curve.tail_bound > 0.0
        if bounded.any():
            own.semilogy(n[bounded], curve.tail_bound[bounded], "--", color=colour, lw=1.2)
    own.plot([], [], "--", color="0.4", lw=1.2, label="proved bound on all later terms")
    own.set_xlabel("bounce n")
    own.set_ylabel("norm of KⁿE, W/(m² sr)")
    own.xaxis.get_major_locator().set_params(integer=True)
    own.grid(True, which="major", color="0.9")
    own.set_axisbelow(True)
    own.spines[["top", "right"]].set_visible(False)
    own.legend(frameon=False, fontsize="small")
    return figure


def stability(own: Map, axes: Any = None) -> Any:
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


def mesh(corners: Float64, cells: Iterable[tuple[str, npt.NDArray[Any]]]) -> Any:
    """Triangles, (n, 3, 3), as pyvista's mesh with named values on each, of which ``L`` is shown."""
    try:
        import pyvista
    except ImportError:
        raise ImportError("meshes need pyvista: pip install pyvista") from None
    count = len(corners)
    faces = np.column_stack([np.full(count, 3), np.arange(3 * count).reshape(count, 3)])
    made = pyvista.PolyData(corners.reshape(-1, 3), faces.ravel())
    for name, values in cells:
        made.cell_data[name] = values
    made.set_active_scalars("L", preference="cell")
    return made
