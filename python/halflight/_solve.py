"""Solving: on patches by the series, to a tolerance by walks of light, and again from a folder."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from typing import Literal, overload

from halflight import _arguments as arguments
from halflight import _native
from halflight._errors import ToleranceWarning
from halflight._lamps import Lamps
from halflight._scene import Scene, native_of
from halflight._solution import Solution, Summing, ToTolerance, solved, walked

__all__ = ["bounces", "open", "solve"]

Progress = bool | Callable[[str, int, int], object] | None

#: More terms than any series has.
ALL = 2**31


@overload
def solve(
    scene: Scene,
    *,
    mode: arguments.Mode | None = None,
    alpha: float | None = None,
    tau: float | None = None,
    patches: int = 4000,
    rays: int = 256,
    bounces: int | None = None,
    truncation: float = 1e-4,
    keep: int | None = None,
    per: None = None,
    seed: int = 0,
    memory: float | None = None,
    progress: Progress = None,
) -> Solution: ...
@overload
def solve(
    scene: Scene,
    *,
    mode: arguments.Mode | None = None,
    alpha: float | None = None,
    tau: float | None = None,
    patches: int = 4000,
    rays: int = 256,
    bounces: None = None,
    truncation: float = 1e-4,
    keep: None = None,
    per: Literal["luminaire"],
    seed: int = 0,
    memory: float | None = None,
    progress: Progress = None,
) -> Lamps: ...
def solve(
    scene: Scene,
    *,
    mode: arguments.Mode | None = None,
    alpha: float | None = None,
    tau: float | None = None,
    patches: int = 4000,
    rays: int = 256,
    bounces: int | None = None,
    truncation: float = 1e-4,
    keep: int | None = None,
    per: Literal["luminaire"] | None = None,
    seed: int = 0,
    memory: float | None = None,
    progress: Progress = None,
) -> Solution | Lamps:
    """Solves L = E + K L on patches by its Neumann series.

    Parameters
    ----------
    scene : Scene
        The scene.
    mode, alpha, tau
        As in :func:`render`.
    patches, rays : int
        About how many patches, and hemisphere rays from each for F.
    bounces : int, optional
        So many bounces, whether the series converges or not; without a number it is summed to ``truncation``.
    truncation : float
        Proved bound on what the series leaves out, as a share of the reflected light.
    keep : int, optional
        How many terms keep their light, E among them; all where it is left out. Each takes 24 bytes a patch, and near
        the frontier there are thousands: 6,754 terms of 4,800 patches take 776 MB. Later terms are summed into
        ``light``; their figures (power, norm, ratio, bound) are there all the same, and so are pictures of L.
    per : {"luminaire"}, optional
        Solve for each luminaire apart, over one K.
    seed, memory, progress
        As in :func:`render`.

    Returns
    -------
    Solution
        L, the terms KⁿE with their figures, K and the patches; :class:`Lamps` for ``per="luminaire"``.

    Raises
    ------
    Diverges
        The series is not proved to converge, and no number of bounces is given.
    DoesNotFit
        K would not fit in memory; ``.fitting`` patches would.

    Notes
    -----
    Errors of L by the size of patches and the noise of F are not estimated here: :func:`render`, :func:`bounces` and
    :func:`points` state theirs.

    Examples
    --------
    >>> import halflight as hl
    >>> box = hl.solve(hl.cornell_box(), patches=300, rays=64)
    >>> box.verdict, box.light.shape == (len(box.patches), 2, 3)
    ('converges', True)
    """
    own = native_of(scene)
    pair = arguments.transport(mode, alpha, tau, scene.transport)
    fineness = arguments.fineness(patches, rays)
    share = arguments.real("truncation", truncation, 1e-12, 1.0)
    count = None if bounces is None else arguments.integer("bounces", bounces, 1, 10_000)
    most = ALL if keep is None else arguments.integer("keep", keep, 1, 10_001)
    apart = arguments.per(per)
    if apart and keep is not None:
        raise ValueError('give either keep or per="luminaire", which keeps no terms')
    if apart and count is not None:
        raise ValueError(
            'give either bounces or per="luminaire": bounces of single luminaires are of halflight.bounces'
        )
    asked = arguments.run(seed, memory, progress)
    if apart:
        own.require_emission()
    system = _native.assemble(own, pair, fineness, apart, asked)
    if apart:
        return Lamps(scene, system, _native.lamps(system, share), share)
    return solved(scene, system, Summing(count, share, most))


def bounces(
    scene: Scene,
    count: int = 8,
    *,
    mode: arguments.Mode | None = None,
    alpha: float | None = None,
    tau: float | None = None,
    tolerance: float = 0.01,
    time: float | None = None,
    per: Literal["luminaire"] | None = None,
    seed: int = 0,
    memory: float | None = None,
    progress: Progress = None,
) -> Solution:
    """The terms of the bounce series with their powers to a tolerance, measured by walks of light.

    Parameters
    ----------
    scene : Scene
        The scene; something in it must emit.
    count : int
        Bounces, E not counted.
    mode, alpha, tau
        As in :func:`render`.
    tolerance : float
        Relative standard error of each term's power to aim at.
    time : float, optional
        Seconds of which walks take half at most. Patches, of which norms and bounds are, follow from the tolerance and
        are solved in any case: ask for a larger one where they take too long.
    per : {"luminaire"}, optional
        Measure each luminaire's terms too: ``luminaires`` of the result.
    seed, memory, progress
        As in :func:`render`.

    Returns
    -------
    Solution
        ``bounces.power`` and ``bounces.error`` are those of the walks; light, norms and bounds those of patches. A
        series that diverges is shown as far as ``count``.

    Raises
    ------
    DoesNotFit
        K would not fit in memory.

    Warns
    -----
    ToleranceWarning
        The error of a term is above the tolerance.
    """
    own = native_of(scene)
    pair = arguments.transport(mode, alpha, tau, scene.transport)
    terms = arguments.integer("count", count, 1, 1000)
    aim = arguments.real("tolerance", tolerance, 0.0, 1.0, open_below=True)
    seconds = None if time is None else arguments.real("time", time, 0.0, 1e9, open_below=True)
    apart = arguments.per(per)
    asked = arguments.run(seed, memory, progress)
    own.require_emission()
    found = walked(scene, ToTolerance(terms, pair, (aim, seconds), apart, asked.seed), memory, progress)
    if (why := found._series.unmet()) is not None:
        warnings.warn(f"the tolerance of {100 * aim:g} % is not met: {why}", ToleranceWarning, stacklevel=2)
    return found


def open(
    folder: str | os.PathLike[str],
    *,
    progress: Progress = None,
) -> Solution:
    """Opens a folder that :meth:`Solution.save`, or ``--save`` of the program, made.

    No ray of F is cast: L is solved again from it, and scene, patches and light come out bit by bit as they were.
    Powers are those of patches, also where :func:`bounces` had measured them. A folder without light is solved.

    Parameters
    ----------
    folder : str or path
        The folder of one mode.
    progress
        As in :func:`render`.

    Returns
    -------
    Solution

    Raises
    ------
    FolderError
        A folder that is damaged, of another version, of several modes, or made to a tolerance.
    """
    asked = arguments.run(0, None, progress)
    native, system, count = _native.open_folder(arguments.path("folder", folder), asked)
    return solved(Scene._of(native), system, Summing(None if count is None else max(count, 1), 1e-4, ALL))
