"""Lights without area: points, spots and parallel light. The camera does not see them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from halflight import _arguments as arguments

__all__ = ["Given", "PointLight", "SpotLight", "SunLight"]

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Given:
    """A light as the native module takes it: a spot has a position and a direction, the sun a direction alone."""

    name: str | None
    intensity: Triple
    position: Triple | None
    direction: Triple | None
    exponent: float = 0.0
    cutoff: float = 0.0


def _point(name: str, value: Any) -> Triple:
    x, y, z = (float(x) for x in arguments.array(name, value, (3,)))
    return (x, y, z)


def _direction(name: str, value: Any) -> Triple:
    x, y, z = _point(name, value)
    most = max(abs(x), abs(y), abs(z))
    if most == 0.0:
        raise ValueError(f"{name} must not be zero: give the way that the light goes, such as (0, -1, 0)")
    return (x / most, y / most, z / most)


def _colour(name: str, value: Any) -> Triple:
    r, g, b = arguments.triple(name, value, 0.0, 3e38)
    return (r, g, b)


def _named(name: Any) -> str | None:
    return None if name is None else arguments.text("name", name)


@dataclass(frozen=True)
class PointLight:
    """Light from a point, alike in all directions.

    At distance d, metres, a surface that faces it at an angle a receives ``intensity cos(a) / d²`` W/m².

    Parameters
    ----------
    position : (3,) floats
        Where it is, in the scene's units.
    intensity : float or (3,) floats
        Radiant intensity, W/sr; it emits ``4 pi intensity`` W.
    name : str, optional
        What the luminaire is called; ``"light 1"``, ``"light 2"``, ... by number where it is left out.

    Raises
    ------
    TypeError, ValueError
        Numbers that are not finite, or a negative intensity.
    """

    position: Any
    intensity: Any
    name: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", _point("position", self.position))
        object.__setattr__(self, "intensity", _colour("intensity", self.intensity))
        _named(self.name)

    def given(self) -> Given:
        """As the native module takes it."""
        return Given(self.name, self.intensity, self.position, None)


@dataclass(frozen=True)
class SpotLight:
    """Light from a point within a cone: ``intensity cos(b)^exponent`` W/sr at the angle b to its axis, 0 beyond it.

    Parameters
    ----------
    position, direction : (3,) floats
        Where it is, in the scene's units, and the way along its axis, of any length but 0.
    intensity : float or (3,) floats
        Radiant intensity along the axis, W/sr.
    cutoff : float
        Half angle of the cone, degrees, above 0 to 90.
    exponent : float
        How fast it weakens away from the axis, 0 or more; at 0 it is even within the cone.
    name : str, optional
        As in :class:`PointLight`.

    Raises
    ------
    TypeError, ValueError
        Numbers that are not finite or outside their range, or a direction of length 0.
    """

    position: Any
    direction: Any
    intensity: Any
    cutoff: float = 90.0
    exponent: float = 0.0
    name: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", _point("position", self.position))
        object.__setattr__(self, "direction", _direction("direction", self.direction))
        object.__setattr__(self, "intensity", _colour("intensity", self.intensity))
        object.__setattr__(self, "cutoff", arguments.real("cutoff", self.cutoff, 0.0, 90.0, open_below=True))
        object.__setattr__(self, "exponent", arguments.real("exponent", self.exponent, 0.0, 1e6))
        _named(self.name)

    def given(self) -> Given:
        """As the native module takes it."""
        cosine = 0.0 if self.cutoff == 90.0 else math.cos(math.radians(self.cutoff))
        return Given(self.name, self.intensity, self.position, self.direction, self.exponent, cosine)


@dataclass(frozen=True)
class SunLight:
    """Parallel light from infinitely far away: ``irradiance cos(a)`` W/m² on a surface that faces it at an angle a.

    Parameters
    ----------
    direction : (3,) floats
        The way that the light goes, of any length but 0: (0, -1, 0) comes from above.
    irradiance : float or (3,) floats
        Irradiance of what faces it, W/m².
    name : str, optional
        As in :class:`PointLight`.

    Raises
    ------
    TypeError, ValueError
        Numbers that are not finite, a negative irradiance, or a direction of length 0.
    """

    direction: Any
    irradiance: Any
    name: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", _direction("direction", self.direction))
        object.__setattr__(self, "irradiance", _colour("irradiance", self.irradiance))
        _named(self.name)

    def given(self) -> Given:
        """As the native module takes it."""
        return Given(self.name, self.irradiance, None, self.direction)
