"""Audits: the error of any picture of a scene, without a reference."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native
from halflight._errors import ToleranceWarning
from halflight._scene import Scene, native_of

__all__ = ["Audit", "Cause", "Estimated", "Part", "audit"]

Float32 = npt.NDArray[np.float32]


class Goal(NamedTuple):
    """What an audit aims at."""

    resolve: float
    tolerance: float
    at_most: float | None
    time: float | None


class Estimated(NamedTuple):
    """A number and its standard error."""

    value: float
    standard_error: float


class Cause(NamedTuple):
    """What would explain a share of the squared error.

    ``kind`` is "brightness" (the picture is so many times as bright), "gamma" (it is the scene's to this power) or
    "shift" (it is shifted by so many pixels to the right, and down).
    """

    kind: str
    numbers: list[Estimated]
    explains: float


class Part(NamedTuple):
    """A part of the picture with its share of the squared error and its mean error, relative to its light."""

    columns: slice
    rows: slice
    share: float
    mean: Estimated


@dataclass(frozen=True, repr=False, eq=False)
class Audit:
    """What is told of a picture.

    Attributes
    ----------
    error : Estimated
        Relative RMS error over the pixels that see no luminaire.
    squared_error : Estimated
        Its square, which is estimated without bias, and below 0 where chance is more than the error.
    mean_error : Estimated
        Light of the picture less that of the scene, relative to that of the scene.
    mean_errors : list of Estimated or None
        The same channel by channel; None where the scene shows no light.
    causes : list of Cause
        What would explain the error, the most first.
    where : list of Part
        Parts of the picture that have much of it.
    signed, rms_map : (height, width, 3) float32
        Picture less scene, and RMS error, W/(m² sr), block by block where it is certain; 0 elsewhere.
    estimate, standard_error : (height, width, 3) float32
        What independent paths found, and its standard error, W/(m² sr).
    mask : (height, width) bool
        The pixels that count.
    is_within : bool or None
        Whether the error is at most ``at_most``; None where that is not certain, and where it was not asked.
    met : bool
        Whether the error is as well known as was asked.
    effective_pixels, pixels : float, int
        Pixels that carry the standard error, and that count.
    rms : float
        RMS of the scene over the pixels that count, W/(m² sr).
    samples, rays : float, int
        Samples of a pixel in the mean, and rays cast.
    seconds : float
        Time that it took.
    """

    error: Estimated
    squared_error: Estimated
    mean_error: Estimated
    mean_errors: list[Estimated | None]
    causes: list[Cause]
    where: list[Part]
    signed: Float32
    rms_map: Float32
    estimate: Float32
    standard_error: Float32
    mask: npt.NDArray[np.bool_]
    is_within: bool | None
    met: bool
    effective_pixels: float
    pixels: int
    rms: float
    samples: float
    rays: int
    seconds: float

    def __repr__(self) -> str:
        value, error = (100 * number for number in self.error)
        return f"<halflight.Audit: {value:.2f} % ± {error:.2f} % off>"


def audit(
    scene: Scene,
    picture: npt.ArrayLike,
    *,
    at_most: float | None = None,
    resolve: float = 0.1,
    tolerance: float = 0.01,
    time: float | None = None,
    mode: arguments.Mode | None = None,
    alpha: float | None = None,
    tau: float | None = None,
    seed: int = 0,
    memory: float | None = None,
    progress: bool | Callable[[str, int, int], object] | None = None,
) -> Audit:
    """Tells the error of any picture of a scene, by paths that share nothing with it.

    Parameters
    ----------
    scene : Scene
        The scene, whose camera the picture is by; something in it must emit.
    picture : (height, width, 3) array
        Linear radiance, W/(m² sr), whatever made it.
    at_most : float, optional
        Sampling ends when it is certain whether the error is at most this.
    resolve : float
        Standard error of the error to aim at, a share of it.
    tolerance : float
        An error that is certainly below this is not resolved further.
    time : float, optional
        Seconds of sampling after which no further round is begun.
    mode, alpha, tau, seed, memory, progress
        As in :func:`render`.

    Returns
    -------
    Audit
        The error with its standard error, its mean, where it is, and what would explain it.

    Raises
    ------
    ValueError
        The picture has a value that is no number, or the series diverges.

    Warns
    -----
    ToleranceWarning
        The error is not known as well as was asked.

    Examples
    --------
    >>> import halflight as hl
    >>> box = hl.cornell_box()
    >>> picture = hl.render(box, size=(32, 32), tolerance=0.05)
    >>> told = hl.audit(box, 1.2 * picture, at_most=0.05)
    >>> told.is_within, told.causes[0].kind
    (False, 'brightness')
    """
    own = native_of(scene)
    pair = arguments.transport(mode, alpha, tau, scene.transport)
    array = np.ascontiguousarray(picture, dtype=np.float32)
    if array.ndim != 3 or array.shape[2] != 3:
        raise ValueError(f"picture must be an array (height, width, 3), not {array.shape}")
    goal = Goal(
        arguments.real("resolve", resolve, 0.0, 1.0, open_below=True),
        arguments.real("tolerance", tolerance, 1e-4, 0.5),
        None if at_most is None else arguments.real("at_most", at_most, 1e-4, 0.5),
        None if time is None else arguments.real("time", time, 0.0, np.inf, open_below=True),
    )
    asked = arguments.run(seed, memory, progress)
    own.require_emission()
    found = _native.audit(own, pair, array, goal, asked)
    return _told(found)


def _told(found: Any) -> Audit:
    (error, squared), (mean, channels) = found.error(), found.mean()
    signed, rms_map, estimate, standard_error, mask = found.maps()
    effective, pixels, rms, samples, rays, seconds = found.taken()
    met, is_within = found.answers()
    if not met:
        warnings.warn("the error is not known as well as was asked: give more time", ToleranceWarning, stacklevel=3)
    causes = [Cause(kind, [Estimated(*n) for n in numbers], share) for kind, numbers, share in found.causes()]
    parts = [Part(slice(*columns), slice(*rows), share, Estimated(*m)) for columns, rows, share, m in found.parts()]
    return Audit(
        Estimated(*error),
        Estimated(*squared),
        Estimated(*mean),
        [None if own is None else Estimated(*own) for own in channels],
        causes,
        parts,
        signed,
        rms_map,
        estimate,
        standard_error,
        mask[..., 0] > 0.5,
        is_within,
        met,
        effective,
        pixels,
        rms,
        samples,
        rays,
        sum(seconds),
    )
