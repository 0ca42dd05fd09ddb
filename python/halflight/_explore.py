"""Pages to play with: one HTML file of a solved scene."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass

from halflight import _arguments as arguments
from halflight import _native
from halflight._scene import Scene, native_of

__all__ = ["Page", "explore"]


@dataclass(frozen=True)
class Effort:
    """How much is done for a page, as the native module takes it."""

    patches: int
    rays: int
    terms: int
    taus: int


@dataclass(frozen=True)
class Page:
    """A page that was written.

    Attributes
    ----------
    file : str
        The HTML file.
    patches, cells, texels, lamps, bytes : int
        Patches that were solved, cells of light, texels of direct light, lamps with sliders, the file's length.
    tau_error : float
        Largest relative RMS error of reflected light at taus between those that were solved.
    rms : float or None
        RMS difference of its picture from a rendered one of 2 %, over the pixels that see no luminaire; ``None`` where
        the series of alpha 1 and tau 0 does not converge.
    """

    file: str
    patches: int
    cells: int
    texels: int
    lamps: int
    bytes: int
    tau_error: float
    rms: float | None


def explore(
    scene: Scene,
    file: str | os.PathLike[str],
    *,
    title: str | None = None,
    attribution: str = "",
    patches: int = 4000,
    rays: int = 1024,
    terms: int = 8,
    taus: int = 5,
    seed: int = 0,
    memory: float | None = None,
    progress: bool | Callable[[str, int, int], object] | None = None,
) -> Page:
    """Writes a page to play with, as the program's ``explore`` does.

    In it anyone may walk through the scene, take bounces away, slide between the modes and turn lamps up and down. It
    is one file that needs no network.

    Parameters
    ----------
    scene : Scene
        The scene; something in it must emit.
    file : str or path
        The page, ``.html``; one that is there is replaced.
    title : str, optional
        What the page is called; the scene's name where it is left out.
    attribution : str
        Who made the scene, and its licence: stands in the page.
    patches, rays : int
        About how many patches, 1 to 100,000, and hemisphere rays from each.
    terms : int
        Terms of the series that are kept apart, E not counted, 2 to 32.
    taus : int
        Values of tau that are solved, 2 to 17; between them light is interpolated.
    seed, memory, progress
        As in :func:`render`.

    Returns
    -------
    Page
        What it holds, and how far it is off.

    Raises
    ------
    OSError
        The file cannot be written; this is looked at before anything is solved.
    DoesNotFit
        The terms would not fit in memory.
    SceneError
        Nothing emits.
    """
    own = native_of(scene)
    place = arguments.path("file", file)
    words = (
        scene.name if title is None else arguments.text("title", title),
        arguments.text("attribution", attribution),
    )
    effort = Effort(
        arguments.integer("patches", patches, 1, 100_000),
        arguments.integer("rays", rays, 1, arguments.MOST_RAYS),
        arguments.integer("terms", terms, 2, 32),
        arguments.integer("taus", taus, 2, 17),
    )
    asked = arguments.run(seed, memory, progress)
    own.require_emission()
    folder = os.path.dirname(place) or "."
    if os.path.isdir(place) or not os.access(folder, os.W_OK):
        raise OSError(f"file cannot be written: {place!r} must name a file in a folder that is there")
    counts, tau_error, rms = _native.explore(own, place, words, effort, asked)
    found, cells, texels, lamps, length = counts
    return Page(place, found, cells, texels, lamps, length, tau_error, rms)
