"""L of each luminaire apart."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native
from halflight._fixed import Fixed
from halflight._kept import Kept, assembled_again, kept
from halflight._patches import Patches
from halflight._scene import Scene

if TYPE_CHECKING:
    from halflight._operator import Operator

__all__ = ["Lamps"]

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]


class Lamps(Fixed):
    """L of each luminaire alone, over one K: light is linear in E, so that any mixture needs no further solve.

    Attributes
    ----------
    scene : Scene
    names : list of str
        The luminaires.
    light : (lamps, patches, 2, 3) float32
        L of each, W/(m² sr).
    rest : (lamps,) float64
        Proved bound on the norm of what is missing of each.
    radius : (float, float)
        Proved bounds on the spectral radius of K.
    verdict : str
        How the series behaves.
    """

    _instead = "mix(...) dims and colours lamps, halflight.solve(scene, ...) solves again"

    def __init__(self, scene: Scene, system: _native.System, found: _native.Lamps, truncation: float) -> None:
        self.scene = scene
        self._system = system
        self._truncation = truncation
        self.names: list[str] = system.luminaires()
        self.light: Float32 = found.light()
        self.light.flags.writeable = False
        self.rest: Float64 = np.array(found.rest())
        lower, upper, self.verdict = found.verdict()
        self.radius = (lower, upper)
        self._fix()

    @property
    def shape(self) -> tuple[int, ...]:
        """(lamps, patches, 2, 3)."""
        return self.light.shape

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> npt.NDArray[Any]:
        if copy is False and dtype is not None and np.dtype(dtype) != self.light.dtype:
            raise ValueError("another type of numbers needs a copy")
        return np.array(self.light, dtype) if copy else np.asarray(self.light, dtype)

    def __len__(self) -> int:
        return len(self.names)

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def keys(self) -> list[str]:
        """The luminaires' names, so that ``dict(lamps)`` has L of each."""
        return list(self.names)

    def __getitem__(self, name: str) -> Float32:
        """L of the luminaire of a name, (patches, 2, 3) float32."""
        return cast(
            "Float32", self.light[self.names.index(arguments.choice("the name of a luminaire", name, self.names))]
        )

    def mix(self, luminaires: Mapping[str, Any]) -> Float32:
        """L with luminaires dimmed, brightened or coloured, without solving again.

        Parameters
        ----------
        luminaires : mapping of str to float or (3,) floats
            Factors by name, 0 or more; those that are not named stay as they are.

        Returns
        -------
        (patches, 2, 3) float32
            L, W/(m² sr).
        """
        factors = np.array(arguments.factors(luminaires, self.names), np.float32).reshape(-1, 3)
        mixed: Float32 = np.einsum("lphc,lc->phc", self.light, factors)
        return mixed

    @property
    def patches(self) -> Patches:
        """Where the patches are, and what they are made of."""
        return Patches(self._system)

    @property
    def operator(self) -> Operator:
        """K."""
        from halflight._operator import Operator

        return Operator(self._system)

    def __repr__(self) -> str:
        return f"<halflight.Lamps {self.scene.name}: {', '.join(self.names)}; {len(self.patches)} patches>"

    def __reduce__(self) -> tuple[Any, ...]:
        return (_lamps_again, (self.scene, kept(self._system), self._truncation))

    def __copy__(self) -> Lamps:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Lamps:
        return self


def _lamps_again(scene: Scene, own: Kept, truncation: float) -> Lamps:
    system = assembled_again(scene._held, own)
    return Lamps(scene, system, _native.lamps(system, truncation), truncation)
