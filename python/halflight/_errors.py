"""Exceptions and warnings of halflight.

What the program's options are called is put into the words of Python: ``--patches 500`` becomes ``patches=500``.
"""

from __future__ import annotations

import re
from typing import Any

__all__ = [
    "Diverges",
    "DoesNotFit",
    "FolderError",
    "HalflightError",
    "SceneError",
    "SceneWarning",
    "ToleranceWarning",
]


def in_python(words: str) -> str:
    """The program's options as arguments."""
    words = re.sub(r"`--([a-z-]+) ([a-z]+)`", lambda m: f'`{m[1].replace("-", "_")}="{m[2]}"`', words)
    named = re.sub(r"--([a-z-]+)[ =](\d[\d.e+-]*)", lambda m: f"{m[1].replace('-', '_')}={m[2]}", words)
    return re.sub(r"--([a-z-]+)(?: [A-Z]+\b)?", lambda m: f"`{m[1].replace('-', '_')}`", named)


class HalflightError(Exception):
    """Every error of halflight that has a class of its own."""

    def __init__(self, message: str, **known: Any) -> None:
        super().__init__(in_python(message))
        self._known = known
        for name, value in known.items():
            setattr(self, name, value)

    def __reduce__(self) -> tuple[Any, ...]:
        return (_again, (type(self), self.args[0], self._known))


def _again(kind: type[HalflightError], message: str, known: dict[str, Any]) -> HalflightError:
    return kind(message, **known)


class SceneError(HalflightError, ValueError):
    """A scene that cannot be read or is wrong.

    Attributes
    ----------
    file : str or None
        The file, or the name of a scene made from arrays.
    line : int or None
        The line of the file, from 1.
    item : (str, int) or None
        What of an array is wrong, such as ``("face", 7)``; or the line again.
    """

    file: str | None = None
    line: int | None = None
    item: tuple[str, int] | None = None


class Diverges(HalflightError, ArithmeticError):
    """The bounce series is not proved to converge, so L has no value that could be computed.

    Attributes
    ----------
    radius : (float, float)
        Proved bounds on the spectral radius of K.
    verdict : str
        ``"diverges"``, or ``"undecided"`` where the bounds enclose 1.
    alpha_limit : float
        The series is proved to converge for every alpha below this.
    """

    radius: tuple[float, float] = (float("nan"), float("nan"))
    verdict: str = "diverges"
    alpha_limit: float = float("nan")


class DoesNotFit(HalflightError, MemoryError):
    """K or a picture would not fit in memory.

    Attributes
    ----------
    bytes, limit : float
        What is needed, and what may be used.
    fitting : int
        Patches, or pixels, that would fit.
    """

    bytes: float = float("nan")
    limit: float = float("nan")
    fitting: int = 0


class FolderError(HalflightError, OSError):
    """A folder of a kept solution that cannot be read, written, or is of something else."""


class ToleranceWarning(UserWarning):
    """A stated error is above the tolerance that was asked for."""


class SceneWarning(UserWarning):
    """What a reader left out of a scene, and what else makes a picture another than one might expect."""
