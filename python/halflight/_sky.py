"""Skies around native scenes, from what a caller gives."""

from __future__ import annotations

from typing import Any

import numpy as np

from halflight import _arguments as arguments
from halflight import _native

__all__ = ["under_patches", "under_sky"]


def under_sky(native: _native.Scene, radiance: Any, lower: Any = None, up: Any = (0.0, 1.0, 0.0)) -> _native.Scene:
    """A scene under a sky of two halves."""
    above = arguments.triple("sky", radiance, 0.0, 3e38)
    below = above if lower is None else arguments.triple("lower", lower, 0.0, 3e38)
    return native.under_sky(above, below, _axis("up", up))


def under_patches(native: _native.Scene, radiance: Any, up: Any, north: Any) -> _native.Scene:
    """A scene under a sky of patches."""
    if np.ndim(radiance) == 1:
        radiance = np.repeat(arguments.array("radiance", radiance, ("n",))[:, None], 3, axis=1)
    light = arguments.array("radiance", radiance, ("n", 3))
    if (light < 0).any() or (light > 3e38).any():
        raise ValueError("radiance must be 0 or more, and below 3e38")
    if len(light) not in [2 + 144 * k * k for k in range(1, 9)]:
        raise ValueError(f"radiance must have 2 + 144 k² rows (146, 578, 1298, 2306 and so on), not {len(light)}")
    level = None if north is None else _axis("north", north)
    found = native.under_patches(light.astype(np.float32).tolist(), _axis("up", up), level)
    if found is None:
        raise ValueError("north must not be along up")
    return found


def _axis(name: str, given: Any) -> list[float]:
    axis = arguments.array(name, given, (3,))
    if not axis.any():
        raise ValueError(f"{name} must not be zero")
    return [float(x) for x in axis / np.abs(axis).max()]
