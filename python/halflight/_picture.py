"""Pictures: arrays of radiances that know their errors."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _images, _native, _plots, _show
from halflight._fixed import refused

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["Errors", "Picture", "Rendered", "Seconds", "made"]

Float32 = npt.NDArray[np.float32]


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

    Pixel (0, 0) is the upper left one. What cannot be set raises ``AttributeError``.

    Attributes
    ----------
    error : Errors or None
        Estimated errors; ``None`` where effort was given in place of a tolerance. Never ``None`` of a
        :class:`Rendered`.
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
        factors = arguments.factors(luminaires, names)
        total = np.zeros(self.shape, np.float32)
        for name, factor in zip(names, factors):
            total += np.asarray(factor, np.float32) * self.layers[f"lamp.{name}"]
        return total

    def srgb(self, exposure: float | str = 0.0) -> npt.NDArray[np.uint8]:
        """What a screen shows of it, the pixels of a PNG file; see :func:`srgb`.

        Parameters
        ----------
        exposure : float or "auto"
            Stops, factors of two, by which it is brighter; at 0 a radiance of 1 is white. ``"auto"`` exposes it by what
            it shows (:func:`exposure`).

        Returns
        -------
        (height, width, 3) uint8
            Codes of sRGB.
        """
        return _images.srgb(self.view(np.ndarray), exposure)

    def plot(self, ax: Axes | None = None, *, exposure: float | str = "auto") -> Axes:
        """Draws it; needs matplotlib.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; new ones where they are left out.
        exposure : float or "auto"
            As in :meth:`srgb`.

        Returns
        -------
        matplotlib.axes.Axes
        """
        return _plots.picture(self.srgb(exposure), ax)

    def save(
        self, file: str | os.PathLike[str], *, exposure: float | str = 0.0, standard_error: bool = False
    ) -> list[str]:
        """Writes it, with its layers.

        Parameters
        ----------
        file : str or path
            ``.exr`` holds radiances, and layers under their names; ``.png`` what the eye is to see of them, layers in
            files of their own beside it.
        exposure : float or "auto"
            Of PNG files, as in :meth:`srgb`; layers are exposed as the picture is.
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
        place = arguments.path("file", file)
        errors = arguments.flag("standard_error", standard_error)
        pixels = arguments.array("the picture", self.view(np.ndarray), ("height", "width", 3), np.float32)
        stops = _images.stops(pixels, exposure)
        unsure: list[tuple[str, Float32]] = []
        if errors and place.lower().endswith(".exr"):
            whole = [] if self.standard_error is None else [("", self.standard_error)]
            unsure = whole + [(name, self.layer_errors[name]) for name in self.layers if name in self.layer_errors]
        if not self.layers and not unsure:
            _native.save_picture(place, pixels, stops)
            return [place]
        layers = list(self.layers.items())
        return [os.fspath(one) for one in _native.save_layers(place, pixels, layers, unsure, stops)]

    def __setattr__(self, name: str, value: Any) -> None:
        raise refused(self, name, "render another, or take the array: numpy.array(picture)")

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
        return (_again, (np.array(self.view(np.ndarray)), dict(self.__dict__)))

    def __copy__(self) -> Picture:
        return self

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Picture:
        return self


class Rendered(Picture):
    """A picture that was rendered to a tolerance, so that its errors are known.

    Attributes are those of :class:`Picture`, of which ``error``, ``standard_error`` and ``relative_error`` are there.
    """

    error: Errors
    standard_error: Float32
    relative_error: float


def _again(pixels: Float32, known: dict[str, Any]) -> Picture:
    pixels.flags.writeable = False
    return made(pixels, **known)


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


def made(pixels: Float32, **known: Any) -> Picture:
    """A picture over an array; what is not known of it is none."""
    picture = pixels.view(Rendered if known.get("error") is not None else Picture)
    picture.__dict__.update(known)
    return picture
