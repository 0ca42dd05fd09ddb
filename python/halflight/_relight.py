"""Lamps of other strengths, from what a run of the program left."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native
from halflight._picture import Picture, made
from halflight._points import wanted_lux

__all__ = ["Relit", "relight"]

Float64 = npt.NDArray[np.float64]


@dataclass(frozen=True, repr=False, eq=False)
class Relit:
    """Light of lamps with other strengths.

    Attributes
    ----------
    factors : dict of str to (3,) float64
        The factor on each lamp, by channel.
    emitted, reflected : dict of str to (3,) float64
        Power of each lamp, and of all that is reflected of its light, W per channel; empty where the file has none.
    picture : Picture or None
        The picture; ``None`` where the file has no layers.
    names : list of str or None
        Names of the points.
    positions, irradiance : (n, 3) float64
        The points, in the scene's units, and their irradiance, W/m² per channel.
    lux : (n,) float64
        Their illuminance.
    is_inside : (n,) bool
        Whether a point is inside of a solid.
    left_over : (float, float) or None
        Root mean square and largest difference to the illuminance wanted, lux; ``None`` where none was.
    error : float or None
        Estimated error of the picture, relative to it; ``None`` where the file is no report, or has no layers.
    """

    factors: dict[str, Float64]
    emitted: dict[str, Float64]
    reflected: dict[str, Float64]
    picture: Picture | None
    names: list[str | None]
    positions: Float64
    irradiance: Float64
    lux: Float64
    is_inside: npt.NDArray[np.bool_]
    left_over: tuple[float, float] | None
    error: float | None

    def __repr__(self) -> str:
        lamps = ", ".join(f"{name} x {factor.mean():.3g}" for name, factor in self.factors.items())
        return f"<halflight.Relit {lamps}; {len(self.lux)} points>"


def relight(
    file: str | os.PathLike[str],
    lamps: Mapping[str, Any] | None = None,
    *,
    lux: npt.ArrayLike | Mapping[str, float] | None = None,
) -> Relit:
    """Multiplies the light of lamps, as the program's ``relight`` does: ``L = sum_e f_e L_e``, without a ray.

    Parameters
    ----------
    file : str or path
        The report of ``halflight render --per luminaire --json``, with the EXR file and the points that it names; or an
        EXR file with layers of lamps, as :meth:`Picture.save` writes it.
    lamps : mapping of str to float or (3,) floats, optional
        Factors by name, 0 or more; those that are not named stay as they are.
    lux : float, (n,) floats, or mapping of str to float, optional
        Illuminance wanted at the points of the report, lux; NaN where nothing is, or by the points' names. Then all
        lamps that ``lamps`` does not name have the factors from 0 to 1 that come nearest in the mean square
        (:meth:`Irradiance.dim`).

    Returns
    -------
    Relit
        Factors, powers, picture and points, and the error of the picture.

    Raises
    ------
    OSError
        A file that cannot be read.
    ValueError
        A file that keeps no lamps apart, a lamp or a point that is not there, or ``lux`` without points.

    Examples
    --------
    >>> import halflight as hl, tempfile, os
    >>> picture = hl.render(hl.cornell_box(), size=(8, 8), tolerance=0.5, layers="luminaires")
    >>> file = os.path.join(tempfile.mkdtemp(), "box.exr")
    >>> _ = picture.save(file)
    >>> hl.relight(file, {"light": 0.5})
    <halflight.Relit light x 0.5; 0 points>
    """
    kept = _native.open_lamps(arguments.path("file", file))
    names = kept.names()
    given = {} if lamps is None else lamps
    own = dict(zip(names, arguments.factors(given, names)))
    factors: dict[str, Any] = {name: own[name] for name in given}
    wanted = None if lux is None else _aims(kept, lux)
    if wanted is not None:
        factors = kept.aimed(wanted, factors)
    all_of_them, powers, points, left_over = kept.relit(factors, wanted)
    pixels = kept.picture(factors)
    return Relit(
        {name: np.array(all_of_them[name]) for name in names},
        {name: np.array(emitted) for name, emitted, _ in powers},
        {name: np.array(reflected) for name, _, reflected in powers},
        None if pixels is None else made(pixels),
        [point[0] for point in points],
        np.array([point[1] for point in points]).reshape(-1, 3),
        np.array([point[2] for point in points]).reshape(-1, 3),
        np.array([point[3] for point in points]),
        np.array([point[4] for point in points], dtype=bool),
        None if left_over is None else (left_over[0], left_over[1]),
        kept.error(factors),
    )


def _aims(kept: _native.KeptLamps, lux: Any) -> list[float | None]:
    """What is wanted at each point; none where nothing is."""
    count, are_apart = kept.points()
    if not are_apart:
        raise ValueError("the file has no points with the light of lamps: render --points FILE --per luminaire --json")
    if not isinstance(lux, Mapping):
        return [None if np.isnan(x) else float(x) for x in wanted_lux(lux, count)]
    wanted = np.full(count, np.nan)
    for name, value in lux.items():
        places = kept.named(arguments.text("the name of a point", name))
        if not places:
            raise ValueError(f"lux names a point {name!r}, and there is none of this name")
        wanted[places] = arguments.real(f"lux[{name!r}]", value, 0.0, 1e30)
    return [None if np.isnan(x) else float(x) for x in wanted_lux(wanted, count)]
