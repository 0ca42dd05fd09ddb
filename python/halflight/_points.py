"""Irradiance at points: what sensors in a scene would measure."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native
from halflight._errors import ToleranceWarning
from halflight._scene import Scene, native_of

if TYPE_CHECKING:
    import pandas

__all__ = ["Irradiance", "lux", "measured", "points", "wanted_lux"]

Float64 = npt.NDArray[np.float64]


def lux(irradiance: npt.ArrayLike) -> Float64:
    """Illuminance in lux of irradiances in W/m²: 683 lm/W times CIE Y of linear sRGB.

    Parameters
    ----------
    irradiance : (..., 3) floats
        Red, green, blue, W/m².

    Returns
    -------
    (...) float64
    """
    given = np.asarray(irradiance)
    if given.dtype.kind not in "fiu" or given.shape[-1:] != (3,):
        raise TypeError(f"irradiance must be numbers of shape (..., 3), not {given.shape} ({given.dtype})")
    rows = np.ascontiguousarray(given, np.float64).reshape(-1, 3)
    return np.asarray(_native.lux(rows), np.float64).reshape(given.shape[:-1])


#: The same where a property has its name.
illuminance = lux


def wanted_lux(lux: Any, count: int) -> Float64:
    """What is wanted at each of some points, lux; NaN where nothing is."""
    given = np.asarray(lux)
    if given.dtype.kind not in "fiu" or given.shape not in [(), (count,)]:
        raise (ValueError if given.dtype.kind in "fiu" else TypeError)(
            f"lux must be one number, or one for each point, ({count},), not {given.shape} ({given.dtype})"
        )
    wanted = np.array(np.broadcast_to(given, (count,)), np.float64)
    if np.isnan(wanted).all():
        raise ValueError("lux must be a number at one point or more, and is NaN everywhere")
    if not (np.isnan(wanted) | ((wanted >= 0.0) & (wanted < np.inf))).all():
        raise ValueError(f"lux must be 0 or more, and finite, not {np.nanmin(wanted):g} to {np.nanmax(wanted):g}")
    return wanted


@dataclass(frozen=True, repr=False, eq=False)
class Irradiance:
    """Irradiance at points.

    Attributes
    ----------
    positions, normals : (n, 3) float64
        The points, and the middles of the hemispheres that light comes from.
    irradiance : (n, 3) float64
        W/m² per channel.
    error : (n, 3) float64
        Its standard error, W/m²: of 100 points 95 are within twice that.
    bounces : (terms, n, 3) float64
        Irradiance by light that was reflected 0, 1, 2, ... times; the last has all that was reflected more.
    luminaires : dict of str to (n, 3) float64
        Irradiance by the light of each luminaire, where those are kept apart.
    is_inside : (n,) bool
        Whether a point is inside of a solid, where most of what it sees are backs of faces.
    met : float
        Share of the points whose error is at most the tolerance.
    patches, rays : int
        Patches at last, and rays cast.
    seconds : float
        Time that it took.
    """

    positions: Float64
    normals: Float64
    irradiance: Float64
    error: Float64
    bounces: Float64
    luminaires: dict[str, Float64]
    is_inside: npt.NDArray[np.bool_]
    met: float
    patches: int
    rays: int
    seconds: float

    @property
    def lux(self) -> Float64:
        """Illuminance, (n,) lux: 683 lm/W times CIE Y of linear sRGB."""
        return illuminance(self.irradiance)

    @property
    def lux_error(self) -> Float64:
        """Its standard error, (n,) lux: at most what the channels' come to together."""
        return illuminance(self.error)

    def mix(self, luminaires: Mapping[str, Any]) -> Float64:
        """The irradiance with luminaires dimmed, brightened or coloured, (n, 3) float64, W/m².

        Parameters
        ----------
        luminaires : mapping of str to float or (3,) floats
            Factors by name, 0 or more; those that are not named stay as they are.
        """
        self._require_luminaires()
        factors = arguments.factors(luminaires, list(self.luminaires))
        total = np.zeros_like(self.irradiance)
        for own, factor in zip(self.luminaires.values(), factors):
            total += np.array(factor) * own
        return total

    def dim(self, lux: npt.ArrayLike, given: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """How far each luminaire is to be dimmed so that the points have some illuminance.

        With ``A_pe`` the illuminance of luminaire e at point p as it was solved for, the factors ``0 <= x_e <= 1`` are
        those with the least ``|A x - lux|²``, and of these, where several are as good, those with the least ``|x|``.
        No ray is cast. What comes of it is ``lux(E.mix(E.dim(500)))``.

        Parameters
        ----------
        lux : float or (n,) floats
            What is wanted at each point, lux; NaN at points where nothing is.
        given : mapping of str to float or (3,) floats, optional
            Luminaires whose factors are fixed, 0 or more.

        Returns
        -------
        dict of str to float
            A factor for each luminaire, those given among them: what ``mix`` of irradiances, pictures and lamps takes.

        Raises
        ------
        ValueError
            The luminaires are not apart, or nothing is wanted at any point.

        Examples
        --------
        >>> import halflight as hl
        >>> lamp = hl.PointLight([0, 2, 0], 10.0, "lamp")
        >>> floor = hl.Scene.from_objects({"floor": hl.quad([-1, 0, -1], [0, 0, 2], [2, 0, 0])}, lights=[lamp])
        >>> E = hl.points(floor, [[0, 0, 0]], [0, 1, 0], per="luminaire")
        >>> round(E.lux[0]), {name: round(x, 3) for name, x in E.dim(500).items()}
        (1708, {'lamp': 0.293})
        """
        self._require_luminaires()
        wanted = wanted_lux(lux, len(self))
        fixed = {} if given is None else given
        arguments.factors(fixed, list(self.luminaires))
        free = [name for name in self.luminaires if name not in fixed]
        if not free:
            return dict(fixed)
        rest = illuminance(self.mix({**dict.fromkeys(free, 0.0), **fixed}))
        asked = ~np.isnan(wanted)
        lit = np.array([illuminance(self.luminaires[name]) for name in free]).T
        found = _native.dimmed(np.ascontiguousarray(lit[asked]), list((wanted - rest)[asked])) or []
        return {**fixed, **dict(zip(free, found))}

    def _require_luminaires(self) -> None:
        if not self.luminaires:
            raise ValueError('there are no luminaires apart: ask for per="luminaire"')

    def to_pandas(self) -> pandas.DataFrame:
        """A table: x, y, z, irradiance and error by channel, lux, lux_error and is_inside; needs pandas."""
        import pandas

        channels = "rgb"
        columns: dict[str, Any] = {name: self.positions[:, k] for k, name in enumerate("xyz")}
        columns |= {f"irradiance_{c}": self.irradiance[:, k] for k, c in enumerate(channels)}
        columns |= {f"error_{c}": self.error[:, k] for k, c in enumerate(channels)}
        return pandas.DataFrame({**columns, "lux": self.lux, "lux_error": self.lux_error, "is_inside": self.is_inside})

    def __len__(self) -> int:
        return len(self.irradiance)

    def __repr__(self) -> str:
        return f"<halflight.Irradiance: {len(self)} points, {100 * self.met:.0f} % within the tolerance>"


def points(
    scene: Scene,
    xyz: npt.ArrayLike,
    normals: npt.ArrayLike,
    *,
    mode: arguments.Mode | None = None,
    alpha: float | None = None,
    tau: float | None = None,
    tolerance: float = 0.01,
    per: Literal["luminaire"] | None = None,
    seed: int = 0,
    memory: float | None = None,
    progress: bool | Callable[[str, int, int], object] | None = None,
) -> Irradiance:
    """Irradiance at points, of the half of light that travels.

    Parameters
    ----------
    scene : Scene
        The scene; something in it must emit.
    xyz : (n, 3) floats
        Positions in the scene's units; on a surface or anywhere else.
    normals : (n, 3) or (3,) floats
        The middle of the directions that light is measured from, of any length but 0; one for all points if there is
        one.
    mode, alpha, tau
        As in :func:`render`.
    tolerance : float
        Relative error to aim at, at each point.
    per : {"luminaire"}, optional
        Keep the light of each luminaire apart.
    seed, memory, progress
        As in :func:`render`.

    Returns
    -------
    Irradiance
        W/m² per channel, with standard errors; ``.lux``.

    Raises
    ------
    Diverges
        The series is not proved to converge.
    ValueError
        A normal of length 0, numbers that are not finite, other shapes.

    Warns
    -----
    ToleranceWarning
        The error of some points is above the tolerance.
    """
    native_of(scene)
    pair = arguments.transport(mode, alpha, tau, scene.transport)
    return measured(
        scene,
        xyz,
        normals,
        transport=pair,
        tolerance=tolerance,
        per=per,
        seed=seed,
        memory=memory,
        progress=progress,
    )


def measured(
    scene: Scene,
    xyz: npt.ArrayLike,
    normals: npt.ArrayLike,
    *,
    transport: tuple[float, float],
    tolerance: float,
    per: Any,
    seed: Any,
    memory: Any,
    progress: Any,
) -> Irradiance:
    """What :func:`points` and ``Solution.points`` find; warns their caller."""
    own = native_of(scene)
    positions = arguments.array("xyz", xyz, ("n", 3)).copy()
    if len(positions) == 0:
        raise ValueError("xyz must have the shape (n, 3), and n is 0")
    if np.abs(positions).max() > 1e150:
        raise ValueError("xyz must be within 1e150")
    given = np.asarray(normals)
    axes = arguments.array("normals", normals, (3,) if given.ndim == 1 else (len(positions), 3))
    axes = np.array(np.broadcast_to(axes, positions.shape))
    lengths = np.abs(axes).max(axis=1)
    if (lengths == 0.0).any():
        raise ValueError(f"normals must not be zero, and normals[{int(np.argmin(lengths))}] is")
    aim = arguments.real("tolerance", tolerance, 0.0, 1.0, open_below=True)
    apart = arguments.per(per)
    asked = arguments.run(seed, memory, progress)
    own.require_emission()
    unit = axes / lengths[:, None] if ((lengths < 1e-100) | (lengths > 1e100)).any() else axes
    found = _native.points(own, transport, (positions, unit), aim, apart, asked)
    irradiance, error = found.irradiance()
    met, patches, rays, seconds = found.taken()
    if met < 1.0:
        warnings.warn(
            f"the error of {100 * (1 - met):.0f} % of the points is above the tolerance of {100 * aim:g} %",
            ToleranceWarning,
            stacklevel=3,
        )
    return Irradiance(
        positions,
        axes,
        irradiance,
        error,
        np.array([found.bounce(n) for n in range(found.bounces())]).reshape(-1, len(positions), 3),
        {name: found.luminaire(name) for name in found.luminaires()},
        np.array(found.is_inside(), dtype=bool),
        met,
        patches,
        rays,
        seconds,
    )
