"""Daylight: coefficients of sky patches at points with their errors, and a year's illuminance."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native
from halflight._errors import ToleranceWarning
from halflight._scene import Scene, native_of

if TYPE_CHECKING:
    import pandas

__all__ = ["Daylight", "DaylightYear", "daylight"]

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]

#: Horizontal illuminance of skies without weather, lx.
_OUTSIDE = 10_000.0


class Asked(NamedTuple):
    """What is asked of daylight."""

    mf: int
    bounces: int | None
    tolerance: float
    up: list[float]
    north: list[float] | None
    sky: str | None
    sun: tuple[float, float] | None
    ground: float
    hours: tuple[float, float]


@dataclass(frozen=True, repr=False, eq=False)
class DaylightYear:
    """What a year of daylight is worth at n points.

    Attributes
    ----------
    autonomy : (n,) float64
        Share of occupied hours with at least 300 lx.
    sunlit : (n,) float64
        Occupied hours with at least 1000 lx of direct sunlight.
    useful : (n, 4) float64
        Share of occupied hours below 100 lx, from 100 to 300, from 300 to 3000, and above (UDI).
    sda : float
        sDA 300/50 %: share of points with an autonomy of at least half.
    ase : float
        ASE 1000/250: share of points with more than 250 sunlit hours.
    hours : float
        Occupied hours.
    """

    autonomy: Float64
    sunlit: Float64
    useful: Float64
    sda: float
    ase: float
    hours: float


@dataclass(frozen=True, repr=False, eq=False)
class Daylight:
    """Daylight coefficients of n points and m columns: the ground, then patches of the sky in Radiance's order.

    Attributes
    ----------
    positions, normals : (n, 3) float64
        The points, and the middles of the hemispheres that light comes from.
    D : (n, m, 3) float64
        Irradiance by a unit of radiance of each column, per channel, sr: ``D[:, :, 0] @ radiances`` is W/m².
    error : (n, m, 3) float64
        Its standard error.
    direct, direct_error : (n, m) float64
        What is seen of each column, cosine-weighted, sr; and its error.
    altitude, azimuth, solid_angle : (m,) float64
        Of the columns' middles, radians from the horizon and from north by east; sr.
    luminance : (skies, m) float64, optional
        Luminance of the skies without the sun, cd/m².
    lux, sunlight : (n, skies) float32, optional
        Illuminance, and that straight from the sun, lx.
    mean, mean_error : (n,) float64, optional
        Mean illuminance over the skies, and its error, lx.
    times : list of (month, day, hour) or None
        Of the skies, in standard time.
    year : DaylightYear, optional
        What a year is worth, where skies have times in occupied hours.
    relative_error : float
        RMS over the columns of a point's errors over that of its coefficients, in the RMS over points.
    met : bool
        Whether that is at most the tolerance.
    patches : int
        Patches at last.
    seconds : float
        Time that it took.
    """

    positions: Float64
    normals: Float64
    D: Float64
    error: Float64
    direct: Float64
    direct_error: Float64
    altitude: Float64
    azimuth: Float64
    solid_angle: Float64
    luminance: Float64 | None
    lux: Float32 | None
    sunlight: Float32 | None
    mean: Float64 | None
    mean_error: Float64 | None
    times: list[tuple[int, int, float] | None]
    year: DaylightYear | None
    relative_error: float
    met: bool
    patches: int
    seconds: float

    @property
    def factor(self) -> Float64:
        """Daylight factor, (n,): mean illuminance over that outside, of a sky without weather (10,000 lx)."""
        if self.mean is None or any(time is not None for time in self.times) or len(self.times) != 1:
            raise ValueError('daylight factors need a sky without weather: sky="overcast"')
        return self.mean / _OUTSIDE

    def to_pandas(self) -> pandas.DataFrame:
        """A table of the points; needs pandas.

        Returns
        -------
        pandas.DataFrame
            x, y and z; with skies lux and lux_error, their means; of a year autonomy, sunlit and the shares of UDI.
        """
        import pandas

        columns: dict[str, Any] = {name: self.positions[:, k] for k, name in enumerate("xyz")}
        if self.mean is not None:
            columns |= {"lux": self.mean, "lux_error": self.mean_error}
        if self.year is not None:
            columns |= {"autonomy": self.year.autonomy, "sunlit": self.year.sunlit}
            names = ("below_100", "100_to_300", "300_to_3000", "above_3000")
            columns |= {name: self.year.useful[:, k] for k, name in enumerate(names)}
        return pandas.DataFrame(columns)

    def hours(self) -> pandas.DataFrame:
        """Illuminance hour by hour: a row a time, a column a point, lx; needs pandas.

        Raises
        ------
        ValueError
            There is no sky.
        """
        import pandas

        if self.lux is None:
            raise ValueError("there is no sky: ask for sky=")
        table = pandas.DataFrame(self.lux.T)
        if all(time is not None for time in self.times):
            times = [time for time in self.times if time is not None]
            table.index = pandas.MultiIndex.from_tuples(times, names=["month", "day", "hour"])
        return table

    def __repr__(self) -> str:
        n, m = self.D.shape[:2]
        return f"<halflight.Daylight: {n} points, {m} columns, estimated error {100 * self.relative_error:.2g} %>"


def _sky(sky: Any) -> tuple[str | None, tuple[float, float] | None]:
    """The file or the kind of a sky, and the sun of a clear one."""
    if sky is None:
        return None, None
    if isinstance(sky, tuple):
        if len(sky) != 3 or sky[0] != "clear":
            raise ValueError('sky must be a file, "overcast", "uniform" or ("clear", altitude, azimuth)')
        altitude = arguments.real("the sun's altitude", sky[1], 0.0, 90.0)
        return "clear", (altitude, arguments.real("the sun's azimuth", sky[2], -360.0, 360.0))
    place = arguments.path("sky", sky)
    if place not in ("overcast", "uniform") and not place.lower().endswith((".epw", ".wea", ".mtx")):
        raise ValueError(
            f'sky must be an .epw, .wea or .mtx file, "overcast", "uniform" or ("clear", ...), not {place!r}'
        )
    return place, None


def daylight(
    scene: Scene,
    xyz: npt.ArrayLike,
    normals: npt.ArrayLike | None = None,
    *,
    sky: str | os.PathLike[str] | tuple[str, float, float] | None = None,
    mf: int = 1,
    bounces: int | None = None,
    tolerance: float = 0.02,
    up: npt.ArrayLike = (0.0, 1.0, 0.0),
    north: npt.ArrayLike | None = None,
    ground: float = 0.2,
    hours: tuple[float, float] = (8.0, 18.0),
    mode: arguments.Mode | None = None,
    alpha: float | None = None,
    tau: float | None = None,
    seed: int = 0,
    memory: float | None = None,
    progress: bool | Callable[[str, int, int], object] | None = None,
) -> Daylight:
    """Daylight coefficients at points, and what skies make of them.

    Parameters
    ----------
    scene : Scene
        The scene, whose own light does not count.
    xyz : (n, 3) floats
        Positions in the scene's units.
    normals : (n, 3) or (3,) floats, optional
        The middle of the directions that light is measured from; ``up`` without.
    sky : path, str or tuple, optional
        A weather file (``.epw``, ``.wea``), a matrix of skies (``.mtx``), ``"overcast"``, ``"uniform"`` or ``("clear",
        altitude, azimuth)`` of the sun in degrees; without it there are coefficients alone.
    mf : int
        The sky is divided by Tregenza (1) or by Reinhart's MF:n, up to 8.
    bounces : int, optional
        Reflections that count: 0 is direct light alone, None all of them.
    tolerance : float
        ``relative_error`` to aim at.
    up, north : (3,) floats
        Directions; north is -z where y is up and y where z is up, if it is not given.
    ground : float
        Reflectance of the ground below the horizon.
    hours : (float, float)
        Hours of the day that count as occupied, standard time.
    mode, alpha, tau, seed, memory, progress
        As in :func:`render`.

    Returns
    -------
    Daylight
        Arrays, and frames by ``.to_pandas()`` and ``.hours()``.

    Raises
    ------
    Diverges
        The series is not proved to converge.
    ValueError
        A weather file that is wrong, with its line; shapes; north along up.
    OSError
        A file that cannot be read.

    Warns
    -----
    ToleranceWarning
        The error is above the tolerance.

    Examples
    --------
    >>> import numpy as np
    >>> import halflight as hl
    >>> ground = hl.Scene.from_objects({"ground": hl.quad([-1, 0, -1], [0, 0, 2], [2, 0, 0])})
    >>> D = hl.daylight(ground, [[0, 5, 0]], bounces=0).D
    >>> D.shape, round(float(D[0, 1:, 0].sum() / np.pi), 5)
    ((1, 146, 3), 1.0)
    """
    own = native_of(scene)
    pair = arguments.transport(mode, alpha, tau, scene.transport)
    positions = arguments.array("xyz", xyz, ("n", 3)).copy()
    if len(positions) == 0:
        raise ValueError("xyz must have the shape (n, 3), and n is 0")
    upwards = [float(x) for x in arguments.array("up", up, (3,))]
    given = np.asarray(upwards if normals is None else normals)
    axes = arguments.array("normals", given, (3,) if given.ndim == 1 else (len(positions), 3))
    axes = np.array(np.broadcast_to(axes, positions.shape))
    if (np.abs(axes).max(axis=1) == 0.0).any():
        raise ValueError("normals must not be zero")
    place, sun = _sky(sky)
    if len(hours) != 2:
        raise ValueError("hours must be two numbers, from and until")
    start = arguments.real("hours[0]", hours[0], 0.0, 24.0)
    end = arguments.real("hours[1]", hours[1], start, 24.0, open_below=True)
    asked = Asked(
        arguments.integer("mf", mf, 1, 8),
        None if bounces is None else arguments.integer("bounces", bounces, 0, 10_000),
        arguments.real("tolerance", tolerance, 1e-4, 0.5),
        upwards,
        None if north is None else [float(x) for x in arguments.array("north", north, (3,))],
        place,
        sun,
        arguments.real("ground", ground, 0.0, 1.0),
        (start, end),
    )
    found = _native.daylight(own, pair, (positions, axes), asked, arguments.run(seed, memory, progress))
    relative, met, patches, seconds = found.taken()
    if not met:
        warnings.warn(
            f"the estimated error of {100 * relative:.2g} % is above the tolerance of {100 * asked.tolerance:g} %",
            ToleranceWarning,
            stacklevel=2,
        )
    (D, error), (direct, direct_error) = found.coefficients(), found.direct()
    altitude, azimuth, solid_angle = found.columns()
    light, means, points, year = found.illuminance(), found.means(), found.points(), found.year()
    lux, sunlight = (None, None) if light is None else light
    mean = None if means is None else np.array(means)
    of_year = None
    if points is not None and year is not None:
        each = [np.array([point[k] for point in points]) for k in range(3)]
        of_year = DaylightYear(each[0], each[1], each[2], *year)
    return Daylight(
        positions,
        axes,
        D,
        error,
        direct,
        direct_error,
        altitude,
        azimuth,
        solid_angle,
        found.luminance(),
        lux,
        sunlight,
        None if mean is None else mean[:, 0],
        None if mean is None else mean[:, 1],
        found.times(),
        of_year,
        relative,
        met,
        patches,
        seconds,
    )
