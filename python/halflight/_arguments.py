"""What arguments may be, said where they are not.

Every function here returns its argument as the native module takes it, or raises ``TypeError`` or ``ValueError``
naming the argument, what was expected, and what was given.
"""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from halflight import _progress

Mode = Literal["global", "shadowless", "one-bounce", "local"]

MODES: dict[str, tuple[float, float]] = {
    "global": (1.0, 0.0),
    "shadowless": (1.0, 1.0),
    "one-bounce": (0.0, 0.0),
    "local": (0.0, 1.0),
}

#: The most patches, rays and samples that are taken, as in the program.
MOST_PATCHES = 1_000_000
MOST_RAYS = 1_048_576
MOST_PIXELS = 1 << 20


@dataclass(frozen=True)
class Run:
    """What is asked of every solve, as the native module takes it."""

    seed: int
    memory: float | None
    progress: Callable[[str, int, int], object] | None


@dataclass(frozen=True)
class Effort:
    """How much is done for a picture, as the native module takes it."""

    tolerance: float | None
    time: float | None
    patches: int
    rays: int
    samples: int


@dataclass(frozen=True)
class Pixels:
    """A picture's width and height, and hemisphere rays for each pixel, as the native module takes them."""

    size: tuple[int, int]
    samples: int


@dataclass(frozen=True)
class Tracing:
    """How paths are traced, as the native module takes it."""

    samples: int | None
    time: float | None
    next_event: bool
    max_bounces: int


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def integer(name: str, value: Any, least: int, most: int) -> int:
    """A whole number between two others."""
    try:
        if isinstance(value, (bool, np.bool_)):
            raise TypeError
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} must be a whole number from {least} to {most}, not {_shown(value)}") from None
    if not least <= number <= most:
        raise ValueError(f"{name} must be from {least} to {most}, not {_shown(number)}")
    return number


def real(name: str, value: Any, least: float, most: float, *, open_below: bool = False) -> float:
    """A number between two others; not the lower one where ``open_below``."""
    words = f"a number {'above' if open_below else 'from'} {least:g}" + ("" if most == math.inf else f" to {most:g}")
    if isinstance(value, (bool, np.bool_, str, bytes, complex)):
        raise TypeError(f"{name} must be {words}, not {_shown(value)}")
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"{name} must be {words}, not {_shown(value)}") from None
    if math.isnan(number) or number < least or number > most or (open_below and number == least) or number == math.inf:
        raise ValueError(f"{name} must be {words}, not {_shown(value)}")
    return number


def flag(name: str, value: Any) -> bool:
    """True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name} must be True or False, not {_shown(value)}")
    return bool(value)


def text(name: str, value: Any) -> str:
    """A text."""
    if not isinstance(value, str):
        raise TypeError(f"{name} must be a text, not {_shown(value)}")
    return value


def path(name: str, value: Any) -> str:
    """A path as text."""
    try:
        found = os.fspath(value)
    except TypeError:
        raise TypeError(f"{name} must be a path, not {_shown(value)}") from None
    if isinstance(found, bytes):
        found = os.fsdecode(found)
    if not found or "\0" in found:
        raise ValueError(f"{name} must be a path, not {_shown(value)}")
    return str(found)


def choice(name: str, value: Any, known: Iterable[str]) -> str:
    """One of several words."""
    words = list(known)
    if not isinstance(value, str):
        raise TypeError(f"{name} must be one of {', '.join(map(repr, words))}, not {_shown(value)}")
    if value not in words:
        raise ValueError(f"{name} must be one of {', '.join(map(repr, words))}, not {_shown(value)}")
    return value


def choices(name: str, value: Any, known: Iterable[str]) -> list[str]:
    """Some of several words: one, or a sequence of them."""
    words = list(known)
    if isinstance(value, str):
        value = [value]
    try:
        given = list(value)
    except TypeError:
        raise TypeError(f"{name} must be some of {', '.join(map(repr, words))}, not {_shown(value)}") from None
    return [choice(name, one, words) for one in given]


def array(name: str, value: Any, shape: Sequence[int | str], dtype: Any = np.float64) -> npt.NDArray[Any]:
    """An array of a shape, whose sides are numbers or the names of any; of any float type and layout; finite."""
    wanted = "(" + ", ".join(map(str, shape)) + ("," if len(shape) == 1 else "") + ")"
    try:
        given = np.asarray(value)
        if given.dtype.kind not in "fiu":
            raise TypeError
    except (TypeError, ValueError):
        kind = getattr(value, "dtype", type(value).__name__)
        raise TypeError(f"{name} must be numbers of shape {wanted}, not {_shown(value)} ({kind})") from None
    fits = given.ndim == len(shape) and all(
        isinstance(side, str) or side == own for side, own in zip(shape, given.shape)
    )
    if not fits:
        raise ValueError(f"{name} must have the shape {wanted}, not {given.shape}")
    with np.errstate(over="ignore"):
        taken = np.ascontiguousarray(given, dtype=dtype)
    if taken.dtype.kind == "f" and not np.isfinite(taken).all():
        where = tuple(int(k) for k in np.argwhere(~np.isfinite(taken))[0])
        raise ValueError(f"{name} must be finite, and {name}{list(where)} is {given[where]!r}")
    return taken


def indices(name: str, value: Any, shape: Sequence[int | str], most: int, what: str) -> npt.NDArray[np.uint32]:
    """Whole numbers from 0 to below ``most``, which count ``what``."""
    wanted = "(" + ", ".join(map(str, shape)) + ("," if len(shape) == 1 else "") + ")"
    try:
        given = np.asarray(value)
    except ValueError:
        raise TypeError(f"{name} must be whole numbers of shape {wanted}, not {_shown(value)}") from None
    if given.size == 0 and given.ndim == len(shape):
        return given.astype(np.uint32)
    if given.dtype.kind not in "iu":
        raise TypeError(f"{name} must be whole numbers of shape {wanted}, not {_shown(value)} ({given.dtype})")
    fits = given.ndim == len(shape) and all(
        isinstance(side, str) or side == own for side, own in zip(shape, given.shape)
    )
    if not fits:
        raise ValueError(f"{name} must have the shape {wanted}, not {given.shape}")
    outside = (given < 0) | (given >= most)
    if outside.any():
        where = tuple(int(k) for k in np.argwhere(outside)[0])
        counted = f"there are {most} {what}, which count from 0" if most else f"there are no {what}"
        raise ValueError(f"{name}{list(where)} is {int(given[where])}, and {counted}")
    return np.ascontiguousarray(given, dtype=np.uint32)


def triple(name: str, value: Any, least: float = -math.inf, most: float = math.inf) -> list[float]:
    """Three numbers; one number stands for three where it is a colour."""
    given = value
    if not isinstance(value, (bool, str, bytes)) and np.ndim(value) == 0 and np.asarray(value).dtype.kind in "fiu":
        given = np.full(3, value)
    elif np.ndim(value) == 0:
        raise TypeError(f"{name} must be one number or three, not {_shown(value)}")
    numbers = array(name, given, (3,))
    outside = (numbers < least) | (numbers > most)
    if outside.any():
        limits = f"from {least:g} to {most:g}" if most < 1e38 or numbers.max() > most else f"{least:g} or more"
        raise ValueError(f"{name} must be {limits}, not {_shown(value)}")
    return [float(x) for x in numbers]


def sequence(name: str, value: Any) -> list[Any]:
    """A sequence that is no text, as a list."""
    if isinstance(value, (str, bytes)):
        raise TypeError(f"{name} must be a sequence, not {_shown(value)}")
    try:
        return list(value)
    except TypeError:
        raise TypeError(f"{name} must be a sequence, not {_shown(value)}") from None


def list_of(name: str, value: Any, kinds: type | tuple[type, ...]) -> list[Any]:
    """A sequence of objects of some classes, as a list."""
    found = sequence(name, value)
    words = " or ".join(kind.__name__ for kind in (kinds if isinstance(kinds, tuple) else (kinds,)))
    for k, one in enumerate(found):
        if not isinstance(one, kinds):
            raise TypeError(f"{name}[{k}] must be a {words}, not {_shown(one)}")
    return found


def size(value: Any) -> tuple[int, int]:
    """Width and height in pixels."""
    if isinstance(value, str):
        raise TypeError(f"size must be (width, height) in pixels, not {_shown(value)}")
    try:
        width, height = value
    except (TypeError, ValueError):
        raise TypeError(f"size must be (width, height) in pixels, not {_shown(value)}") from None
    return integer("size[0]", width, 1, MOST_PIXELS), integer("size[1]", height, 1, MOST_PIXELS)


def transport(mode: Any, alpha: Any, tau: Any, own: tuple[float, float] | None) -> tuple[float, float]:
    """(alpha, tau) of a mode by name, or of numbers in place of it; else those of the scene, or global."""
    if mode is not None and (alpha is not None or tau is not None):
        raise ValueError("give either a mode or alpha and tau: a mode is a name for two such numbers")
    if mode is not None:
        return MODES[choice("mode", mode, MODES)]
    base = own if own is not None else MODES["global"]
    return (
        base[0] if alpha is None else real("alpha", alpha, 0.0, 1.0),
        base[1] if tau is None else real("tau", tau, 0.0, 1.0),
    )


def run(seed: Any, memory: Any, progress: Any) -> Run:
    """What is asked of every solve; memory in GiB."""
    gib = None if memory is None else real("memory", memory, 0.0, 1e9, open_below=True) * 2**30
    return Run(integer("seed", seed, 0, 2**32 - 1), gib, _progress.shown(progress))


def fineness(patches: Any, rays: Any) -> tuple[int, int]:
    """Numbers of patches and of rays from each."""
    return integer("patches", patches, 1, MOST_PATCHES), integer("rays", rays, 1, MOST_RAYS)


def pixels(size_: Any, samples: Any) -> Pixels:
    """Size and samples of a picture."""
    return Pixels(size(size_), integer("samples", samples, 1, MOST_RAYS))


def exposure(value: Any) -> float | None:
    """Stops; none where a picture is to be shown by what it shows, ``"auto"``."""
    if isinstance(value, str):
        choice("exposure", value, ["auto"])
        return None
    return real("exposure", value, -100.0, 100.0)


def factors(luminaires: Any, names: Sequence[str]) -> list[list[float]]:
    """A factor for each channel of each luminaire; 1 where none is given."""
    if not isinstance(luminaires, Mapping):
        raise TypeError(f"luminaires must be a mapping of names to factors, not {luminaires!r}")
    for name in luminaires:
        choice("the name of a luminaire", name, names)
    return [triple(f"the factor of {name!r}", luminaires.get(name, 1.0), 0.0) for name in names]


def per(value: Any) -> bool:
    """Whether luminaires are kept apart."""
    return value is not None and choice("per", value, ["luminaire"]) == "luminaire"
