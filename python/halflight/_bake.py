"""Lightmaps: the irradiance of a scene's surfaces laid out flat."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native
from halflight._errors import ToleranceWarning
from halflight._scene import Scene, native_of

__all__ = ["LightMaps", "bake"]

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]


class Effort(NamedTuple):
    """How a scene is baked."""

    texels: int
    padding: int
    tolerance: float
    indirect: bool
    luminaires: bool


@dataclass(frozen=True, repr=False, eq=False)
class LightMaps:
    """Maps of irradiance.

    Attributes
    ----------
    irradiance : (texels, texels, 3) float32
        W/m² per channel; texels that show nothing have that of their neighbours.
    standard_error : (texels, texels, 3) float32
        Its standard error by the rays that gather, W/m².
    rms, error : float
        RMS irradiance over what texels show, W/m², and its estimated relative RMS error, all causes together.
    luminaires : dict of str to (texels, texels, 3) float32
        Irradiance by the light of each luminaire, where those are kept apart; they add up to the irradiance.
    luminaire_errors : dict of str to float
        The estimated error of each, relative to its own RMS.
    coverage : (texels, texels) float64
        Share of each texel that shows something, 0 to 1.
    uv : (faces, 3, 2) float64
        Where the corners of the scene's faces lie, shares of the map's sides from the upper left.
    scale : float
        Texels a unit of the scene.
    met : bool
        Whether the error is at most the tolerance.
    patches, rays : int
        Patches at last, and rays cast.
    seconds : float
        Time that it took.
    """

    irradiance: Float32
    standard_error: Float32
    rms: float
    error: float
    luminaires: dict[str, Float32]
    luminaire_errors: dict[str, float]
    coverage: Float64
    uv: Float64
    scale: float
    met: bool
    patches: int
    rays: int
    seconds: float
    _held: _native.Baked
    _name: str

    def mix(self, luminaires: Mapping[str, Any]) -> Float32:
        """The map with luminaires dimmed, brightened or coloured, (texels, texels, 3) float32, W/m².

        Parameters
        ----------
        luminaires : mapping of str to float or (3,) floats
            Factors by name, 0 or more; those that are not named stay as they are.

        Raises
        ------
        ValueError
            The luminaires are not apart.
        """
        if not self.luminaires:
            raise ValueError('there are no luminaires apart: ask for per="luminaire"')
        factors = arguments.factors(luminaires, list(self.luminaires))
        total = np.zeros_like(self.irradiance)
        for own, factor in zip(self.luminaires.values(), factors):
            total += np.array(factor, np.float32) * own
        return total

    def save(self, folder: str | os.PathLike[str], *, standard_error: bool = False) -> list[str]:
        """Writes the maps as EXR and PNG, a ``.glb`` file that uses them and a JSON that names them, as ``bake`` of the
        program does.

        Parameters
        ----------
        folder : str or path
            Made if there is none.
        standard_error : bool
            Whether the EXR files have the standard error as a layer.

        Returns
        -------
        list of str
            The files.

        Raises
        ------
        OSError
            A file cannot be written.
        """
        place = arguments.path("folder", folder)
        return [str(file) for file in self._held.save(place, self._name, bool(standard_error))]

    def __repr__(self) -> str:
        side = len(self.irradiance)
        return f"<halflight.LightMaps: {side} x {side} texels, estimated error {100 * self.error:.2g} %>"


def bake(
    scene: Scene,
    *,
    texels: int = 512,
    padding: int = 2,
    tolerance: float = 0.05,
    indirect: bool = False,
    per: Literal["luminaire"] | None = None,
    mode: arguments.Mode | None = None,
    alpha: float | None = None,
    tau: float | None = None,
    seed: int = 0,
    memory: float | None = None,
    progress: bool | Callable[[str, int, int], object] | None = None,
) -> LightMaps:
    """Bakes the light of a scene onto its surfaces.

    Parameters
    ----------
    scene : Scene
        The scene; something in it must emit. Its surfaces are laid out anew, whatever file it is from.
    texels : int
        Texels to a side of the map, 16 to 8192.
    padding : int
        Texels around every chart, filled from it, 0 to 64.
    tolerance : float
        Relative RMS error over the texels to aim at, 0.0001 to 0.5.
    indirect : bool
        Leave out what arrives straight from luminaires.
    per : {"luminaire"}, optional
        Keep the light of each luminaire apart; not with ``indirect``.
    mode, alpha, tau, seed, memory, progress
        As in :func:`render`.

    Returns
    -------
    LightMaps
        Irradiance, W/m², with its errors; ``.save(folder)``.

    Raises
    ------
    Diverges
        The series is not proved to converge.
    ValueError
        More charts than fit in so many texels.

    Warns
    -----
    ToleranceWarning
        The error is above the tolerance.

    Examples
    --------
    >>> import halflight as hl
    >>> maps = hl.bake(hl.cornell_box(), texels=64, tolerance=0.1, per="luminaire")
    >>> maps.irradiance.shape, maps.met, list(maps.luminaires)
    ((64, 64, 3), True, ['light'])
    """
    own = native_of(scene)
    pair = arguments.transport(mode, alpha, tau, scene.transport)
    effort = Effort(
        arguments.integer("texels", texels, 16, 8192),
        arguments.integer("padding", padding, 0, 64),
        arguments.real("tolerance", tolerance, 1e-4, 0.5),
        bool(indirect),
        arguments.per(per),
    )
    if effort.indirect and effort.luminaires:
        raise ValueError("indirect light is known of all luminaires together: leave out indirect or per")
    asked = arguments.run(seed, memory, progress)
    own.require_emission()
    found = _native.bake(own, pair, effort, asked)
    irradiance, standard_error = found.map()
    names, errors = found.luminaires(), found.errors()
    scale, patches, rays, seconds, met = found.taken()
    why = found.why()
    if why is not None:
        warnings.warn(why, ToleranceWarning, stacklevel=2)
    return LightMaps(
        irradiance,
        standard_error,
        *errors[0],
        {name: found.map(k)[0] for k, name in enumerate(names)},
        {name: error for name, (_, error) in zip(names, errors[1:])},
        found.coverage(),
        found.uv(),
        scale,
        met,
        patches,
        rays,
        seconds,
        found,
        scene.name,
    )
