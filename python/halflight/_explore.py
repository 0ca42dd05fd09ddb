"""Pages to play with: one HTML file of a solved scene, which a notebook shows."""

from __future__ import annotations

import html
import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

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
    tolerance: float
    bytes: int


@dataclass(frozen=True)
class Page:
    """A page that was made. In a notebook it shows itself.

    Attributes
    ----------
    file : str or None
        The HTML file; ``None`` where none was asked for.
    html : str
        What stands in it.
    patches, cells, texels, lamps, bytes : int
        Patches that were solved, cells of light, texels of direct light, lamps with sliders, the file's length.
    tau_error : float
        Largest relative RMS error of reflected light at taus between those that were solved.
    rms : float or None
        RMS difference of its picture from a rendered one of 2 %, over the pixels that see no luminaire; ``None`` where
        the series of alpha 1 and tau 0 does not converge.
    """

    file: str | None
    patches: int
    cells: int
    texels: int
    lamps: int
    bytes: int
    tau_error: float
    rms: float | None
    html: str = field(repr=False)

    def _repr_html_(self) -> str:
        """The page in a frame of its own, as notebooks show it."""
        return (
            f'<iframe srcdoc="{html.escape(self.html)}" width="100%" height="640" style="border: 0" '
            'allow="fullscreen" title="A page to play with, made by halflight"></iframe>'
        )


def explore(
    scene: Scene,
    file: str | os.PathLike[str] | None = None,
    *,
    title: str | None = None,
    attribution: str = "",
    story: bool = False,
    patches: int = 4000,
    rays: int = 1024,
    terms: int = 8,
    taus: int = 5,
    tolerance: float = 0.1,
    megabytes: float = 8.0,
    seed: int = 0,
    memory: float | None = None,
    progress: bool | Callable[[str, int, int], object] | None = None,
) -> Page:
    """Writes a page to play with, as the program's ``explore`` does.

    In it anyone may walk through the scene, take bounces away, slide between the modes, change reflectances and turn
    lamps up and down. It is one file that needs no network; where it is the last value of a cell, a notebook shows it.

    Parameters
    ----------
    scene : Scene
        The scene; something in it must emit.
    file : str or path, optional
        The page, ``.html``; one that is there is replaced. Where it is left out, the page is only shown.
    title : str, optional
        What the page is called; the scene's name where it is left out.
    attribution : str
        Who made the scene, and its licence: stands in the page.
    story : bool
        Whether it opens with the story alone: five cards, after which come the controls.
    patches, rays : int
        About how many patches, 1 to 100,000, and hemisphere rays from each.
    terms : int
        Terms of the series that are kept apart, E not counted, 2 to 32.
    taus : int
        Values of tau that are solved, 2 to 17; between them light is interpolated.
    tolerance : float
        How near its picture by the file's camera shall be to a rendered one, relative RMS: patches and cells of light
        are made finer where it is not, as long as the page is not too large.
    megabytes : float
        How large finer cells may make it, 0.1 to 1000.
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
    words = (
        scene.name if title is None else arguments.text("title", title),
        arguments.text("attribution", attribution),
        arguments.flag("story", story),
    )
    effort = Effort(
        arguments.integer("patches", patches, 1, 100_000),
        arguments.integer("rays", rays, 1, arguments.MOST_RAYS),
        arguments.integer("terms", terms, 2, 32),
        arguments.integer("taus", taus, 2, 17),
        arguments.real("tolerance", tolerance, 1e-9, 1.0),
        int(1e6 * arguments.real("megabytes", megabytes, 0.1, 1000.0)),
    )
    asked = arguments.run(seed, memory, progress)
    own.require_emission()
    if file is None:
        with tempfile.TemporaryDirectory() as folder:
            return _written(own, os.path.join(folder, "page.html"), words, effort, asked, keep=False)
    place = arguments.path("file", file)
    folder = os.path.dirname(place) or "."
    if os.path.isdir(place) or not os.access(folder, os.W_OK):
        raise OSError(f"file cannot be written: {place!r} must name a file in a folder that is there")
    return _written(own, place, words, effort, asked, keep=True)


def _written(
    own: _native.Scene, place: str, words: tuple[str, str, bool], effort: Effort, asked: object, *, keep: bool
) -> Page:
    """The page of a scene, written to a place."""
    counts, tau_error, rms = _native.explore(own, place, words, effort, asked)
    found, cells, texels, lamps, length = counts
    text = Path(place).read_text(encoding="utf-8")
    return Page(place if keep else None, found, cells, texels, lamps, length, tau_error, rms, text)
