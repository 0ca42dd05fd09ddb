"""Rendering: to a stated error, or path by path."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import Any, Literal, overload

import numpy as np

from halflight import _arguments as arguments
from halflight import _native
from halflight._errors import SceneWarning, ToleranceWarning
from halflight._picture import Errors, Picture, Rendered, Seconds, made
from halflight._scene import Scene, native_of

__all__ = ["render", "trace", "warn_of_backs"]

Layers = Literal["bounces", "luminaires"] | Sequence[Literal["bounces", "luminaires"]]
Progress = bool | Callable[[str, int, int], object] | None

#: Share of the camera's rays that may meet black backs before it is worth a warning, as in the program.
BACKS = 0.01


@overload
def render(
    scene: Scene,
    *,
    mode: arguments.Mode | None = None,
    alpha: float | None = None,
    tau: float | None = None,
    size: tuple[int, int] = (512, 512),
    tolerance: float | None = None,
    time: float | None = None,
    patches: None = None,
    rays: None = None,
    samples: None = None,
    layers: Layers = (),
    seed: int = 0,
    memory: float | None = None,
    progress: Progress = None,
) -> Rendered: ...
@overload
def render(
    scene: Scene,
    *,
    mode: arguments.Mode | None = None,
    alpha: float | None = None,
    tau: float | None = None,
    size: tuple[int, int] = (512, 512),
    tolerance: None = None,
    time: None = None,
    patches: int | None = None,
    rays: int | None = None,
    samples: int | None = None,
    layers: Layers = (),
    seed: int = 0,
    memory: float | None = None,
    progress: Progress = None,
) -> Picture: ...
def render(
    scene: Scene,
    *,
    mode: arguments.Mode | None = None,
    alpha: float | None = None,
    tau: float | None = None,
    size: tuple[int, int] = (512, 512),
    tolerance: float | None = None,
    time: float | None = None,
    patches: int | None = None,
    rays: int | None = None,
    samples: int | None = None,
    layers: Layers = (),
    seed: int = 0,
    memory: float | None = None,
    progress: Progress = None,
) -> Picture:
    """Renders a scene from its camera: L = E + K L solved, and its visible half gathered.

    Parameters
    ----------
    scene : Scene
        The scene; something in it must emit.
    mode : {"global", "shadowless", "one-bounce", "local"}, optional
        The illumination model; the scene file's, or global.
    alpha, tau : float, optional
        Interreflection and transmission, 0 to 1, in place of a mode.
    size : (int, int)
        Width and height in pixels.
    tolerance : float, optional
        Relative RMS error to aim at over the pixels that see no luminaire, such as 0.01, which it is where neither this
        nor an effort is given.
    time : float, optional
        Seconds after which the search for a tolerance ends with what it has.
    patches, rays, samples : int, optional
        Effort in place of a tolerance: about how many patches (4000), hemisphere rays from each (256) and for each
        pixel (128). Then the error is not estimated.
    layers : {"bounces", "luminaires"} or both, optional
        What the picture is taken apart into besides.
    seed : int
        Chooses the rays; the same seed gives the same bits on any number of threads.
    memory : float, optional
        GiB that K or the picture may take; four fifths of what is free.
    progress : bool or callable, optional
        ``True`` shows a bar; a function is called with (step, done, length).

    Returns
    -------
    Rendered
        (height, width, 3) float32, linear radiance, W/(m² sr), with its errors; a :class:`Picture`, of which errors are
        not known, where effort was given in place of a tolerance.

    Raises
    ------
    Diverges
        The series is not proved to converge; ``.radius`` has the bounds.
    DoesNotFit
        K or the picture would not fit in memory.
    SceneError
        Nothing emits.

    Warns
    -----
    ToleranceWarning
        The stated error is above the tolerance; the warning says why.

    Examples
    --------
    >>> import halflight as hl
    >>> picture = hl.render(hl.cornell_box(), size=(32, 32), tolerance=0.1)
    >>> picture.shape, picture.error.total <= 0.1
    ((32, 32, 3), True)
    """
    own = native_of(scene)
    pair = arguments.transport(mode, alpha, tau, scene.transport)
    pixels = arguments.size(size)
    effort = _effort(tolerance, time, patches, rays, samples)
    kinds = arguments.choices("layers", layers, ["bounces", "luminaires"])
    asked = arguments.run(seed, memory, progress)
    own.require_emission()
    found = _native.render(own, pair, pixels, effort, ("bounces" in kinds, "luminaires" in kinds), asked)
    held = [(name, found.layer(k)) for k, name in enumerate(found.layers())]
    lower, upper, verdict = found.verdict()
    count, cast = found.counts()
    picture = made(
        found.picture(),
        error=None if effort.tolerance is None else Errors(*found.error()),
        relative_error=None if effort.tolerance is None else found.error()[-1],
        standard_error=found.standard_error(),
        layers={name: layer for name, (layer, _) in held},
        layer_errors={name: error for name, (_, error) in held},
        luminaires={name: np.array(emitted) for name, emitted, _ in found.luminaires()},
        radius=(lower, upper),
        verdict=verdict,
        seconds=Seconds(*found.seconds()),
        patches=count,
        rays=cast,
    )
    if effort.tolerance is not None and (why := found.unmet(effort.tolerance)) is not None:
        warnings.warn(why, ToleranceWarning, stacklevel=2)
    warn_of_backs(found.backs(), 3)
    return picture


def warn_of_backs(share: float, level: int) -> None:
    """Warns of black backs in a picture, as from so many calls further out."""
    if share > BACKS:
        warnings.warn(
            f"{100 * share:.1f} % of the camera's rays meet the black backs of one-sided faces: turn these faces, or "
            "give their material two sides (two_sided=True)",
            SceneWarning,
            stacklevel=level,
        )


def _effort(tolerance: Any, time: Any, patches: Any, rays: Any, samples: Any) -> arguments.Effort:
    """A tolerance, or the effort given in its place."""
    efforts = {"patches": patches, "rays": rays, "samples": samples}
    given = [name for name, value in efforts.items() if value is not None]
    if given and (tolerance is not None or time is not None):
        raise ValueError(f"give either a tolerance (and time) or an effort, not both: {', '.join(given)}")
    aim = None
    if not given:
        aim = arguments.real("tolerance", 0.01 if tolerance is None else tolerance, 0.0, 1.0, open_below=True)
    return arguments.Effort(
        aim,
        None if time is None else arguments.real("time", time, 0.0, 1e9, open_below=True),
        *arguments.fineness(4000 if patches is None else patches, 256 if rays is None else rays),
        arguments.integer("samples", 128 if samples is None else samples, 1, arguments.MOST_RAYS),
    )


def trace(
    scene: Scene,
    *,
    mode: arguments.Mode | None = None,
    alpha: float | None = None,
    tau: float | None = None,
    size: tuple[int, int] = (512, 512),
    samples: int | None = None,
    time: float | None = None,
    next_event: bool = True,
    max_bounces: int = 128,
    seed: int = 0,
    memory: float | None = None,
    progress: Progress = None,
) -> Picture:
    """Traces paths from the scene's camera: the witness that shares nothing with the solver but rays.

    Parameters
    ----------
    scene : Scene
        The scene; something in it must emit.
    mode, alpha, tau
        As in :func:`render`.
    size : (int, int)
        Width and height in pixels.
    samples : int, optional
        Paths a pixel; 64 where neither this nor ``time`` is given.
    time : float, optional
        Seconds after which no further pass begins.
    next_event : bool
        Whether emitters are sampled at every vertex.
    max_bounces : int
        Reflections after which a path ends in any case.
    seed, memory, progress
        As in :func:`render`.

    Returns
    -------
    Picture
        (height, width, 3) float32, W/(m² sr); ``standard_error`` and ``relative_error`` say how far it may be off.

    Raises
    ------
    Diverges
        Light grew beyond single precision.

    Warns
    -----
    ToleranceWarning
        ``max_bounces`` ended paths with light still to gather: later bounces are missing.
    """
    own = native_of(scene)
    pair = arguments.transport(mode, alpha, tau, scene.transport)
    pixels = arguments.size(size)
    count = 64 if samples is None and time is None else samples
    tracing = arguments.Tracing(
        None if count is None else arguments.integer("samples", count, 1, 2**31 - 1),
        None if time is None else arguments.real("time", time, 0.0, 1e9, open_below=True),
        arguments.flag("next_event", next_event),
        arguments.integer("max_bounces", max_bounces, 0, 1_000_000),
    )
    asked = arguments.run(seed, memory, progress)
    own.require_emission()
    found, standard_error, taken, error, (paths, cast, cut), seconds = _native.trace(own, pair, pixels, tracing, asked)
    if cut > 0:
        warnings.warn(
            f"{100 * cut / paths:.2f} % of the paths were cut after {max_bounces} bounces; the picture is the series "
            "up to there",
            ToleranceWarning,
            stacklevel=2,
        )
    return made(
        found,
        standard_error=standard_error,
        verdict="sampled" if cut == 0 else "truncated",
        seconds=Seconds(0.0, 0.0, 0.0, seconds, seconds),
        rays=cast,
        samples=taken,
        relative_error=error,
    )
