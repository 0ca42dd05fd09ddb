"""Progress of long work: a bar, or a function of the caller's."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, cast

import numpy as np


def shown(progress: Any) -> Callable[[str, int, int], object] | None:
    """The function that is called with step, done and length some twenty times a second; none where nobody looks."""
    if isinstance(progress, np.bool_):
        progress = bool(progress)
    if progress is None or progress is False:
        return None
    if progress is True:
        return _Bar()
    if not callable(progress):
        raise TypeError(f"progress must be True, False or a function of (step, done, length), not {progress!r}")
    return cast("Callable[[str, int, int], object] | None", progress)


class _Bar:
    """tqdm's bar where it is installed, lines on the standard error where it is not."""

    def __init__(self) -> None:
        self._step = ""
        self._bar: Any = None
        self._shown = -1
        try:
            from tqdm.auto import tqdm

            self._tqdm: Any = tqdm
        except ImportError:
            self._tqdm = None

    def __call__(self, step: str, done: int, length: int) -> None:
        if self._tqdm is None:
            percent = 100 * done // max(length, 1)
            if step != self._step or percent >= self._shown + 10:
                self._step, self._shown = step, percent
                print(f"{step}: {percent} %", file=sys.stderr)
            return
        if step != self._step or self._bar is None or self._bar.total != length or done < self._bar.n:
            self.close()
            self._step = step
            self._bar = self._tqdm(total=length, desc=step, leave=False)
        self._bar.update(done - self._bar.n)

    def close(self) -> None:
        """Ends the bar."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None

    def __del__(self) -> None:
        self.close()
