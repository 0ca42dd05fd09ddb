"""Equations as they are pickled: F and what it was made for, from which all else comes out as it was."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native

__all__ = ["Kept", "again", "assembled_again", "kept"]

Float32 = npt.NDArray[np.float32]


@dataclass(frozen=True)
class Kept:
    """What an equation is made of beside its scene, as the native module takes F."""

    mode: tuple[float, float]
    fineness: tuple[int, int]
    seed: int
    luminaires: bool
    row_sums: tuple[float, float, float] | None
    indptr: npt.NDArray[np.int64]
    indices: npt.NDArray[np.int32]
    data: Float32


def kept(system: _native.System) -> Kept:
    """What an equation is made of."""
    indices, data = system.factors()
    mode, fineness, seed, luminaires = system.recipe()
    return Kept(mode, fineness, seed, luminaires, system.row_sums(), system.starts(), indices.view(np.int32), data)


def assembled_again(scene: _native.Scene, own: Kept) -> _native.System:
    """The equation made again, bit by bit."""
    asked = arguments.run(own.seed, None, None)
    return _native.assemble_kept(scene, own.mode, own.fineness, own.luminaires, own, asked)


def again(kind: Any, scene: bytes, own: Kept) -> Any:
    """What is made of an equation alone, made again."""
    return kind(assembled_again(_native.scene_from_bytes(scene), own))
