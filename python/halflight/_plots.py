"""Axes by matplotlib and meshes for pyvista, imported when they are asked for."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, cast

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["Curve", "Map", "bounces", "mesh", "picture", "stability"]

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
    @property
    def variance_exact(self) -> bool: ...


def _axes(ax: Any, size: tuple[float, float]) -> Any:
    """The axes given, or new ones."""
    if ax is None:
        try:
            import matplotlib.pyplot as plt
        except ImportError:
            raise ImportError("plots need matplotlib: pip install matplotlib") from None
        return plt.subplots(figsize=size, layout="constrained")[1]
    if not hasattr(ax, "imshow"):
        raise TypeError(f"ax must be matplotlib's Axes, not {ax!r}: figure.add_subplot() makes some")
    return ax


def picture(codes: npt.NDArray[np.uint8], ax: Axes | None = None) -> Axes:
    """A picture as sRGB codes, without ticks."""
    height, width = codes.shape[:2]
    side = 6.0 / max(height, width)
    own: Any = _axes(ax, (max(1.0, side * width), max(1.0, side * height)))
    own.imshow(codes, interpolation="nearest")
    own.set(xticks=[], yticks=[])
    return cast("Axes", own)


def bounces(curves: Sequence[Curve], ax: Axes | None = None) -> Axes:
    """Norms of the terms and the proved bounds on what follows each, over n."""
    own: Any = _axes(ax, (7.0, 4.4))
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
    return cast("Axes", own)


def stability(mapped: Map, ax: Axes | None = None) -> Axes:
    """The spectral radius over the square, alpha to the right and tau upwards, with both frontiers."""
    own: Any = _axes(ax, (6.0, 5.0))
    middle = 0.5 * (mapped.lower + mapped.upper)
    shown = own.pcolormesh(mapped.alpha, mapped.tau, middle, cmap="viridis", shading="gouraud", vmin=0.0)
    own.figure.colorbar(shown, ax=own, label="spectral radius of K")
    levels = [level for level in (0.25, 0.5, 0.75) if level < middle.max()]
    if levels:
        lines = own.contour(mapped.alpha, mapped.tau, middle, levels, colors="white", linewidths=0.7)
        own.clabel(lines, fmt="%.2f", fontsize="x-small")
    infinite = "to the right: a path tracer's variance is infinite"
    variance = infinite if mapped.variance_exact else "to the left: a path tracer's variance is finite"
    for points, style, label in [
        (mapped.frontier, "-", "to the right: the series diverges"),
        (mapped.variance_frontier, "--", variance),
    ]:
        if len(points):
            own.plot(points[:, 1], points[:, 0], style, color="white", lw=3.2)
            own.plot(points[:, 1], points[:, 0], style, color="black", lw=1.6, label=label)
    own.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0), xlabel="alpha, interreflection", ylabel="tau, transmission")
    own.set_title(mapped.name, fontsize="medium")
    if any(len(points) and points[:, 1].min() < 1.0 for points in (mapped.frontier, mapped.variance_frontier)):
        own.legend(loc="lower left", fontsize="small", framealpha=0.9)
    return cast("Axes", own)


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
