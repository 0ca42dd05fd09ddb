"""Arrays of radiances as images: sRGB codes, files, and the exposure they are shown at."""

from __future__ import annotations

import os
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native

__all__ = ["exposure", "read_picture", "save_picture", "srgb", "stops"]

Float32 = npt.NDArray[np.float32]


def _pixels(picture: Any) -> Float32:
    given = np.asarray(picture)
    return cast("Float32", arguments.array("picture", given.view(np.ndarray), ("height", "width", 3), np.float32))


def exposure(picture: npt.ArrayLike) -> float:
    """The stops at which a picture is shown well, as the program shows scenes of one's own.

    ``log2(0.5 / Y)``, Y being the luminance, CIE Y of linear sRGB, that nine in ten of the pixels that show any light
    do not exceed: lamps in view are white, and neither their strength nor the unit of light changes what is seen.

    Parameters
    ----------
    picture : (height, width, 3) floats
        Linear radiance.

    Returns
    -------
    float
        Stops; 0 where all is dark.

    Raises
    ------
    TypeError, ValueError
        An array of another shape or kind.
    """
    found = _native.exposure_of(_pixels(picture))
    return 0.0 if found is None else found


def stops(picture: Any, given: Any) -> float:
    """An exposure as stops; that of a picture itself where it is ``"auto"``."""
    fixed = arguments.exposure(given)
    return exposure(picture) if fixed is None else fixed


def srgb(picture: npt.ArrayLike, exposure: float | str = 0.0) -> npt.NDArray[np.uint8]:
    """What a screen shows of radiances, bit by bit as PNG files have it.

    ``code = round(255 f(min(1, 2^exposure L)))`` with f the sRGB curve (IEC 61966-2-1); NaN becomes 0.

    Parameters
    ----------
    picture : (height, width, 3) floats
        Linear radiance L.
    exposure : float or "auto"
        Stops, factors of two, by which it is brighter; at 0 a radiance of 1 is white. ``"auto"`` exposes it by what it
        shows (:func:`exposure`).

    Returns
    -------
    (height, width, 3) uint8
        Codes of sRGB.

    Raises
    ------
    TypeError, ValueError
        An array of another shape or kind, or an exposure that is none.

    Examples
    --------
    >>> import halflight as hl, numpy as np
    >>> hl.srgb(np.full((1, 1, 3), 0.5)).tolist(), hl.srgb(np.full((1, 1, 3), 0.5), exposure=1).tolist()
    ([[[188, 188, 188]]], [[[255, 255, 255]]])
    """
    pixels = _pixels(picture)
    return np.asarray(_native.srgb(pixels, stops(pixels, exposure)), np.uint8)


def save_picture(file: str | os.PathLike[str], picture: npt.ArrayLike, *, exposure: float | str = 0.0) -> None:
    """Writes any array of radiances.

    Parameters
    ----------
    file : str or path
        ``.exr`` holds the numbers, ``.png`` what the eye is to see of them.
    picture : (height, width, 3) floats
        Linear radiance.
    exposure : float or "auto"
        Of a PNG file, as in :func:`srgb`.

    Raises
    ------
    OSError
        Another extension, or a file that cannot be written.
    """
    pixels = _pixels(picture)
    _native.save_picture(arguments.path("file", file), pixels, stops(pixels, exposure))


def read_picture(file: str | os.PathLike[str]) -> Float32:
    """Reads an ``.exr``, ``.hdr`` or ``.png`` file: linear radiance, (height, width, 3) float32.

    Parameters
    ----------
    file : str or path
        The file.

    Raises
    ------
    OSError
        A file that cannot be read.
    """
    return cast("Float32", _native.read_picture(arguments.path("file", file)))
