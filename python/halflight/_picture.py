"""Pictures: rendered to a stated error, or traced path by path."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, cast

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native, _show
from halflight._errors import SceneWarning, ToleranceWarning
from halflight._scene import Scene

__all__ = ["Errors", "Picture", "Seconds", "read_picture", "render", "save_picture", "trace"]

Float32 = npt.NDArray[np.float32]

#: Share of the camera's rays that may meet black backs before it is worth a warning, as in the program.
BACKS = 0.01


@dataclass(frozen=True)
class Errors:
    """Estimated relative errors of a picture: shares of its RMS radiance over pixels that see no luminaire.

    Attributes
    ----------
    form_factors : float
        Noise of F.
    patches : float
        Light read on patches in place of points.
    truncation : float
        What the series left out, a bound.
    gather : float
        Sampling of the gather pass.
    emission : float
        Light as emitted, over the RMS of what all pixels show of it; no part of the total.
    total : float
        All others together, the root of the sum of squares.
    """

    form_factors: float
    patches: float
    truncation: float
    gather: float
    emission: float
    total: float


@dataclass(frozen=True)
class Seconds:
    """Where the time went.

    Attributes
    ----------
    patches, form_factors, solve, gather, total : float
        Seconds of cutting patches and making rays ready, of casting F, of the series, of the pixels, of all.
    """

    patches: float
    form_factors: float
    solve: float
    gather: float
    total: float


class Picture(np.ndarray[tuple[int, int, int], np.dtype[np.float32]]):
    """Linear radiance of the visible half, W/(m² sr): an array (height, width, 3) float32 that knows its error.

    It cannot be written to: its memory is halflight's. What is computed from it is a plain array.

    Attributes
    ----------
    error : Errors or None
        Estimated errors; ``None`` where effort was given in place of a tolerance.
    standard_error : (height, width, 3) float32 or None
        Of each pixel, by the gather pass or by path tracing.
    layers : dict of str to (height, width, 3) float32
        The picture taken apart, such as ``"lamp.desk"`` and ``"bounce.2"``; each kind adds up to the picture.
    layer_errors : dict of str to (height, width, 3) float32
        The standard error of each layer.
    luminaires : dict of str to (3,) float64
        Power that each emits, W per channel, where they are kept apart.
    radius : (float, float)
        Proved bounds on the spectral radius of K.
    verdict : str
        How the series behaves: ``"converges"`` or ``"ends"``; of a traced picture ``"sampled"`` or ``"truncated"``.
    seconds : Seconds
        Where the time went.
    patches, rays : int
        Patches at last; rays cast in all.
    samples : int or None
        Paths a pixel of a traced picture.
    relative_error : float or None
        The error as one number: ``error.total`` of a rendered picture; of a traced one RMS of the standard errors over
        RMS of the radiances, where no luminaire is seen.
    """

    error: Errors | None
    standard_error: Float32 | None
    layers: dict[str, Float32]
    layer_errors: dict[str, Float32]
    luminaires: dict[str, npt.NDArray[np.float64]]
    radius: tuple[float, float]
    verdict: str
    seconds: Seconds
    patches: int
    rays: int
    samples: int | None
    relative_error: float | None

    # What arrays are made of pictures are arrays.

    def __array_finalize__(self, made_from: Any) -> None:
        # What numpy makes of it under this class all the same, such as a transpose, knows nothing.
        self.__dict__.update(_unknown())

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **named: Any) -> Any:
        def plain(value: Any) -> Any:
            return value.view(np.ndarray) if isinstance(value, Picture) else value

        if "out" in named:
            named["out"] = tuple(plain(one) for one in named["out"])
        return getattr(ufunc, method)(*(plain(one) for one in inputs), **named)

    def __array_function__(self, function: Any, types: Any, args: Any, named: Any) -> Any:
        def plain(value: Any) -> Any:
            if isinstance(value, Picture):
                return value.view(np.ndarray)
            if isinstance(value, (list, tuple)):
                return type(value)(plain(one) for one in value)
            return value

        return function(*plain(tuple(args)), **{name: plain(value) for name, value in named.items()})

    def __getitem__(self, key: Any) -> Any:
        return self.view(np.ndarray)[key]

    def mix(self, luminaires: Mapping[str, Any]) -> Float32:
        """The picture with luminaires dimmed, brightened or coloured; exact, since light is linear in E.

        Parameters
        ----------
        luminaires : mapping of str to float or (3,) floats
            Factors on luminaires by their names, 0 or more; those that are not named stay as they are. The picture
            must have been rendered with ``layers="luminaires"``.

        Returns
        -------
        (height, width, 3) float32
        """
        names = [name.removeprefix("lamp.") for name in self.layers if name.startswith("lamp.")]
        if not names:
            raise ValueError('the picture has no luminaires apart: render it with layers="luminaires"')
        factors = factors_of(luminaires, names)
        total = np.zeros(self.shape, np.float32)
        for name, factor in zip(names, factors):
            total += np.asarray(factor, np.float32) * self.layers[f"lamp.{name}"]
        return total

    def save(self, file: str | os.PathLike[str], *, exposure: float = 0.0, standard_error: bool = False) -> list[str]:
        """Writes it, with its layers.

        Parameters
        ----------
        file : str or path
            ``.exr`` holds radiances, and layers under their names; ``.png`` what the eye is to see of them, layers in
            files of their own beside it.
        exposure : float
            Stops, factors of two, by which PNG files are brighter.
        standard_error : bool
            Whether an EXR file has the standard errors as layers.

        Returns
        -------
        list of str
            The files.

        Raises
        ------
        OSError
            Another extension, or a file that cannot be written; then there is none.
        """
        place, stops = arguments.path("file", file), arguments.real("exposure", exposure, -100.0, 100.0)
        errors = arguments.flag("standard_error", standard_error)
        pixels = arguments.array("the picture", self.view(np.ndarray), ("height", "width", 3), np.float32)
        unsure: list[tuple[str, Float32]] = []
        if errors and place.lower().endswith(".exr"):
            whole = [] if self.standard_error is None else [("", self.standard_error)]
            unsure = whole + [(name, self.layer_errors[name]) for name in self.layers if name in self.layer_errors]
        if not self.layers and not unsure:
            _native.save_picture(place, pixels, stops)
            return [place]
        layers = list(self.layers.items())
        return [os.fspath(one) for one in _native.save_layers(place, pixels, layers, unsure, stops)]

    def __repr__(self) -> str:
        if self.ndim != 3:
            return repr(self.view(np.ndarray))
        return f"<halflight.Picture {self.shape[1]}x{self.shape[0]}: {self._said()}>"

    __str__ = __repr__

    def _said(self) -> str:
        known = getattr(self, "relative_error", None)
        words = "error not estimated" if known is None else f"error {100 * known:.2f} %"
        seconds = getattr(self, "seconds", None)
        return words if seconds is None else f"{words}, {seconds.total:.2f} s"

    def _repr_html_(self) -> str | None:
        if self.ndim != 3 or self.shape[-1] != 3 or self.size == 0:
            return None
        return _show.picture(self, self._said())

    def __reduce__(self) -> tuple[Any, ...]:
        return (_picture_again, (np.array(self.view(np.ndarray)), dict(self.__dict__)))

    def __copy__(self) -> Picture:
        return self

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Picture:
        return self


def _picture_again(pixels: Float32, known: dict[str, Any]) -> Picture:
    pixels.flags.writeable = False
    return _picture(pixels, **known)


def _unknown() -> dict[str, Any]:
    """What is known of a picture of which nothing is."""
    return {
        "error": None,
        "standard_error": None,
        "layers": {},
        "layer_errors": {},
        "luminaires": {},
        "radius": (math.nan, math.nan),
        "verdict": "",
        "seconds": Seconds(0.0, 0.0, 0.0, 0.0, 0.0),
        "patches": 0,
        "rays": 0,
        "samples": None,
        "relative_error": None,
    }


def _picture(pixels: Float32, **known: Any) -> Picture:
    """A picture over an array; what is not known of it is none."""
    picture = pixels.view(Picture)
    picture.__dict__.update(known)
    return picture


def factors_of(luminaires: Mapping[str, Any], names: Sequence[str]) -> list[list[float]]:
    """A factor for each channel of each luminaire; 1 where none is given."""
    if not isinstance(luminaires, Mapping):
        raise TypeError(f"luminaires must be a mapping of names to factors, not {luminaires!r}")
    for name in luminaires:
        arguments.choice("the name of a luminaire", name, names)
    return [arguments.triple(f"the factor of {name!r}", luminaires.get(name, 1.0), 0.0) for name in names]


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
    layers: Literal["bounces", "luminaires"] | Sequence[Literal["bounces", "luminaires"]] = (),
    seed: int = 0,
    memory: float | None = None,
    progress: bool | Callable[[str, int, int], object] | None = None,
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
    Picture
        (height, width, 3) float32, linear radiance, W/(m² sr), with its errors.

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
    own = of(scene)
    pair = arguments.transport(mode, alpha, tau, scene.transport)
    pixels = arguments.size(size)
    effort = effort_of(tolerance, time, patches, rays, samples)
    kinds = arguments.choices("layers", layers, ["bounces", "luminaires"])
    asked = arguments.run(seed, memory, progress)
    own.require_emission()
    made = _native.render(own, pair, pixels, effort, ("bounces" in kinds, "luminaires" in kinds), asked)
    held = [(name, made.layer(k)) for k, name in enumerate(made.layers())]
    lower, upper, verdict = made.verdict()
    count, cast = made.counts()
    picture = _picture(
        made.picture(),
        error=None if effort.tolerance is None else Errors(*made.error()),
        relative_error=None if effort.tolerance is None else made.error()[-1],
        standard_error=made.standard_error(),
        layers={name: layer for name, (layer, _) in held},
        layer_errors={name: error for name, (_, error) in held},
        luminaires={name: np.array(emitted) for name, emitted, _ in made.luminaires()},
        radius=(lower, upper),
        verdict=verdict,
        seconds=Seconds(*made.seconds()),
        patches=count,
        rays=cast,
    )
    if effort.tolerance is not None and (why := made.unmet(effort.tolerance)) is not None:
        warnings.warn(why, ToleranceWarning, stacklevel=2)
    if made.backs() > BACKS:
        warnings.warn(
            f"{100 * made.backs():.1f} % of the camera's rays meet the black backs of one-sided faces: turn these "
            "faces, or give their material two sides (two_sided=True)",
            SceneWarning,
            stacklevel=2,
        )
    return picture


def of(scene: Any) -> _native.Scene:
    """The native part of a scene."""
    if not isinstance(scene, Scene):
        hint = ": read it with halflight.load first" if isinstance(scene, (str, os.PathLike)) else ""
        raise TypeError(f"scene must be a halflight.Scene, not {scene!r}{hint}")
    return scene._held


def effort_of(tolerance: Any, time: Any, patches: Any, rays: Any, samples: Any) -> arguments.Effort:
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
    progress: bool | Callable[[str, int, int], object] | None = None,
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
    own = of(scene)
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
    return _picture(
        found,
        standard_error=standard_error,
        verdict="sampled" if cut == 0 else "truncated",
        seconds=Seconds(0.0, 0.0, 0.0, seconds, seconds),
        rays=cast,
        samples=taken,
        relative_error=error,
    )


def save_picture(file: str | os.PathLike[str], picture: npt.ArrayLike, *, exposure: float = 0.0) -> None:
    """Writes any array of radiances.

    Parameters
    ----------
    file : str or path
        ``.exr`` holds the numbers, ``.png`` what the eye is to see of them.
    picture : (height, width, 3) floats
        Linear radiance.
    exposure : float
        Stops by which a PNG file is brighter.
    """
    pixels = arguments.array("picture", picture, ("height", "width", 3), np.float32)
    _native.save_picture(arguments.path("file", file), pixels, arguments.real("exposure", exposure, -100.0, 100.0))


def read_picture(file: str | os.PathLike[str]) -> Float32:
    """Reads an ``.exr``, ``.hdr`` or ``.png`` file: linear radiance, (height, width, 3) float32."""
    return cast("Float32", _native.read_picture(arguments.path("file", file)))
