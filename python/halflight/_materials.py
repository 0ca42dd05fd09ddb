"""What surfaces are made of: numbers, and textures from arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native

__all__ = ["Material", "Texture"]

#: Pixels of a texture to a side at most.
MOST = 1 << 15


@dataclass(frozen=True, eq=False)
class Texture:
    """An image on a surface: a factor on reflectance or emission that differs from point to point.

    Texture coordinates (u, v) of the vertices are linear over each face: (0, 0) is the lower left corner of the image,
    (1, 1) the upper right one. Texel (row i, column j) has its middle at ``u = (j + 0.5) / width``,
    ``v = 1 - (i + 0.5) / height``.

    Parameters
    ----------
    image : (height, width) or (height, width, 3) array
        Row 0 is the upper one. uint8 are sRGB codes, as files have them; floats are linear, 0 to 1, and kept as the
        nearest sRGB code, so within 0.5 % of 1.
    wrap : {"repeat", "mirror", "clamp"}
        What is beyond the edges of the image.
    filter : {"linear", "nearest"}
        What is between the middles of texels: the four around in linear light, or the nearest.

    Attributes
    ----------
    codes : (height, width, 1 or 3) uint8
        The sRGB codes.

    Raises
    ------
    TypeError, ValueError
        An array of another shape or kind, or floats outside 0 to 1.

    Examples
    --------
    >>> import halflight as hl, numpy as np
    >>> checker = hl.Texture(np.indices((8, 8)).sum(axis=0) % 2 * 1.0, filter="nearest")
    >>> checker.codes.shape, int(checker.codes.max())
    ((8, 8, 1), 255)
    """

    image: Any
    wrap: Literal["repeat", "mirror", "clamp"] = "repeat"
    filter: Literal["linear", "nearest"] = "linear"
    codes: npt.NDArray[np.uint8] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        arguments.choice("wrap", self.wrap, ["repeat", "mirror", "clamp"])
        arguments.choice("filter", self.filter, ["linear", "nearest"])
        codes = _codes(self.image)
        codes.flags.writeable = False
        object.__setattr__(self, "codes", codes)
        object.__setattr__(self, "image", codes if codes.shape[2] == 3 else codes[..., 0])

    def __repr__(self) -> str:
        height, width, channels = self.codes.shape
        return f"<halflight.Texture {width}x{height}, {'grey' if channels == 1 else 'RGB'}, {self.wrap}, {self.filter}>"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Texture):
            return NotImplemented
        same = (self.wrap, self.filter) == (other.wrap, other.filter)
        return same and np.array_equal(self.codes, other.codes)

    def __hash__(self) -> int:
        return hash((self.codes.shape, self.wrap, self.filter))


def _codes(image: Any) -> npt.NDArray[np.uint8]:
    """An image as sRGB codes, (height, width, 1 or 3)."""
    given = np.asarray(image)
    fits = given.ndim == 2 or (given.ndim == 3 and given.shape[2] == 3)
    if not fits or given.dtype.kind not in "fiu" or (given.dtype.kind in "iu" and given.dtype != np.uint8):
        raise (ValueError if given.dtype.kind in "fiu" else TypeError)(
            "image must be (height, width) or (height, width, 3), uint8 codes of sRGB or floats from 0 to 1, "
            f"not {given.shape} ({given.dtype}): divide codes of more than 8 bits by their largest, leave alpha out"
        )
    if not 1 <= min(given.shape[:2]) <= max(given.shape[:2]) <= MOST:
        raise ValueError(f"image must have 1 to {MOST} texels a side, not {given.shape}")
    three = given if given.ndim == 3 else given[..., None]
    if given.dtype == np.uint8:
        return np.array(three)
    linear = arguments.array("image", three, ("height", "width", three.shape[2]), np.float32)
    if linear.min() < 0.0 or linear.max() > 1.0:
        raise ValueError(f"image must be from 0 to 1, not {linear.min():g} to {linear.max():g}: give the factor apart")
    wide = np.ascontiguousarray(np.broadcast_to(linear, (*linear.shape[:2], 3)))
    return np.ascontiguousarray(_native.srgb(wide, 0.0)[..., : linear.shape[2]])


@dataclass(frozen=True)
class Material:
    """A diffuse material.

    Parameters
    ----------
    name : str
        What it is called.
    rho : float or (3,) floats
        Reflectance, 0 to 1; one number for all channels, or red, green and blue.
    emission : float or (3,) floats
        Emitted radiance, W/(m² sr).
    alpha, tau : float, optional
        Its own interreflection and transmission, 0 to 1, whatever mode is solved.
    two_sided : bool
        Whether both sides of its faces reflect and emit; the back of a one-sided face is black.
    visible_emission : bool
        Whether the camera sees the emission; a hidden lamp lights the scene and is black itself.
    rho_texture, emission_texture : Texture or array, optional
        Factors on rho and on the emission that differ from point to point: ``rho(x) = rho t(x)``. The scene's vertices
        need coordinates, ``uv``; an array is taken as ``Texture(array)``.

    Raises
    ------
    TypeError, ValueError
        A number that is none, or outside its range.
    """

    name: str
    rho: Any = 0.5
    emission: Any = 0.0
    alpha: float | None = None
    tau: float | None = None
    two_sided: bool = False
    visible_emission: bool = True
    rho_texture: Any = None
    emission_texture: Any = None

    def __post_init__(self) -> None:
        def own(name: str, value: object) -> None:
            object.__setattr__(self, name, value)

        arguments.text("name", self.name)
        own("rho", tuple(arguments.triple("rho", self.rho, 0.0, 1.0)))
        own("emission", tuple(arguments.triple("emission", self.emission, 0.0, 3e38)))
        own("alpha", None if self.alpha is None else arguments.real("alpha", self.alpha, 0.0, 1.0))
        own("tau", None if self.tau is None else arguments.real("tau", self.tau, 0.0, 1.0))
        own("two_sided", arguments.flag("two_sided", self.two_sided))
        own("visible_emission", arguments.flag("visible_emission", self.visible_emission))
        for name in ("rho_texture", "emission_texture"):
            given = getattr(self, name)
            own(name, given if given is None or isinstance(given, Texture) else Texture(given))

    @property
    def is_textured(self) -> bool:
        """Whether it has a texture, so that its faces need coordinates."""
        return self.rho_texture is not None or self.emission_texture is not None
