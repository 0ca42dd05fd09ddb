"""Cameras."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from halflight import _arguments as arguments

__all__ = ["Camera"]


@dataclass(frozen=True)
class Camera:
    """A pinhole camera in the units of the scene.

    Parameters
    ----------
    position, target : (3,) floats
        The eye, and a point in the middle of the picture.
    up : (3,) floats
        What is up in the picture; not along the view.
    vertical_fov : float
        Full vertical field of view, degrees, between 0 and 180.
    """

    position: Any
    target: Any
    up: Any = (0.0, 1.0, 0.0)
    vertical_fov: float = 40.0

    def __post_init__(self) -> None:
        for name in ("position", "target", "up"):
            point = arguments.array(name, getattr(self, name), (3,))
            object.__setattr__(self, name, tuple(float(x) for x in point))
        fov = arguments.real("vertical_fov", self.vertical_fov, 0.0, 179.999, open_below=True)
        object.__setattr__(self, "vertical_fov", fov)
