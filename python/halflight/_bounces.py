"""The terms of the bounce series, and their figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, cast, overload

import numpy as np
import numpy.typing as npt

from halflight import _native, _show
from halflight._fixed import Fixed

if TYPE_CHECKING:
    import pandas

__all__ = ["Bounce", "Bounces"]

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]


@dataclass(frozen=True, repr=False, eq=False)
class Bounce:
    """A term of the series: light that was reflected n times.

    Attributes
    ----------
    n : int
        Number of reflections.
    power, power_invisible : (3,) float64
        Power of each half per channel, W: pi times the sum of area times light.
    norm : float
        Area-weighted RMS over patches, channels and halves, W/(m² sr).
    ratio : float
        The norm over that of the term before; NaN for n = 0.
    tail_bound : float
        Proved bound on the norm of all later terms together; NaN where there is none.
    error : float
        Relative standard error of the power where walks of light measured it (:func:`bounces`); NaN elsewhere.
    """

    n: int
    power: Float64
    power_invisible: Float64
    norm: float
    ratio: float
    tail_bound: float
    error: float
    _light: Float32 | None

    @property
    def light(self) -> Float32:
        """``KⁿE``, (patches, 2, 3) float32, W/(m² sr): invisible and visible half; red, green, blue; a view.

        Raises
        ------
        ValueError
            The term was not kept.
        """
        if self._light is None:
            raise ValueError(f"the light of term {self.n} was not kept: solve with keep={self.n + 1} or more")
        return self._light

    def __repr__(self) -> str:
        red, green, blue = self.power
        tail = f"all later at most {self.tail_bound:.3g}"
        return f"<halflight.Bounce {self.n}: {red:.4g}, {green:.4g}, {blue:.4g} W, {tail}>"


class Summed(Protocol):
    """What has a series."""

    _series: _native.Series


class Bounces(Sequence[Bounce], Fixed):
    """The terms E, KE, K²E, ... of a series; their figures are arrays over n.

    ``bounces[2].light`` is K²E on the patches.
    """

    _instead = "solve again: halflight.solve(scene, ...)"

    def __init__(self, solution: Summed) -> None:
        self._solution = solution
        series = self._series = solution._series
        self._power, self._power_invisible = series.powers()
        self._figures = np.array(series.figures()).reshape(-1, 3)
        errors = series.errors()
        self._error = np.array(errors) if errors else np.full(len(self._figures), np.nan)
        for numbers in (self._power, self._power_invisible, self._figures, self._error):
            numbers.flags.writeable = False
        self._fix()

    def __len__(self) -> int:
        return len(self._figures)

    @overload
    def __getitem__(self, n: int) -> Bounce: ...
    @overload
    def __getitem__(self, n: slice) -> list[Bounce]: ...
    def __getitem__(self, n: int | slice) -> Bounce | list[Bounce]:
        if isinstance(n, slice):
            return [self._one(k) for k in range(*n.indices(len(self)))]
        k = n + len(self) if n < 0 else n
        if not 0 <= k < len(self):
            raise IndexError(f"there are bounces 0 to {len(self) - 1}, and {n} is none of them")
        return self._one(k)

    def _one(self, n: int) -> Bounce:
        norm, ratio, tail = (float(x) for x in self._figures[n])
        error = float(self._error[n])
        light = self._series.term(n) if n < self.kept else None
        return Bounce(n, self._power[n], self._power_invisible[n], norm, ratio, tail, error, light)

    def __iter__(self) -> Iterator[Bounce]:
        return (self._one(n) for n in range(len(self)))

    @property
    def kept(self) -> int:
        """How many terms have their light, E among them: ``keep`` of :func:`solve`, or all."""
        return self._series.kept()

    @property
    def power(self) -> Float64:
        """Power of the visible half of each term per channel, W, (terms, 3)."""
        return cast("Float64", self._power)

    @property
    def power_invisible(self) -> Float64:
        """Power of the invisible half of each term per channel, W, (terms, 3)."""
        return cast("Float64", self._power_invisible)

    @property
    def norm(self) -> Float64:
        """Norm of each term, W/(m² sr), (terms,)."""
        return self._figures[:, 0]

    @property
    def ratio(self) -> Float64:
        """Norm of each term over that of the one before, (terms,)."""
        return self._figures[:, 1]

    @property
    def tail_bound(self) -> Float64:
        """Proved bound on the norm of all that follows each term, (terms,); NaN where there is none."""
        return self._figures[:, 2]

    @property
    def error(self) -> Float64:
        """Relative standard error of each power, (terms,); NaN where it was not measured."""
        return self._error

    def to_pandas(self) -> pandas.DataFrame:
        """The figures as a table; needs pandas.

        Returns
        -------
        pandas.DataFrame
            A row for each n, the index. Columns ``power_r``, ``power_g``, ``power_b`` and ``power_invisible_r``, ...
            (W), ``norm`` and ``tail_bound`` (W/(m² sr)), ``ratio`` and ``error``; NaN where there is none.
        """
        import pandas

        columns = {f"power_{c}": self.power[:, k] for k, c in enumerate("rgb")}
        columns |= {f"power_invisible_{c}": self.power_invisible[:, k] for k, c in enumerate("rgb")}
        columns |= {name: getattr(self, name) for name in ("norm", "ratio", "tail_bound", "error")}
        return pandas.DataFrame(columns, index=pandas.RangeIndex(len(self), name="n"))

    def _repr_html_(self) -> str:
        return _show.bounces(self)

    def __repr__(self) -> str:
        return f"<halflight.Bounces: E and {len(self) - 1} bounces>"

    def __reduce__(self) -> tuple[Any, ...]:
        return (Bounces, (self._solution,))
