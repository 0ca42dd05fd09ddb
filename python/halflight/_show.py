"""What notebooks show of objects: HTML without a network."""

from __future__ import annotations

import base64
import html
import math
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from halflight import _arguments as arguments
from halflight import _native

#: Pixels along the longer side that are shown at most, and of a scene's preview.
MOST = 1024
PREVIEW = 192


class Term(Protocol):
    """What the table of bounces says of each."""

    @property
    def n(self) -> int: ...
    @property
    def power(self) -> npt.NDArray[np.float64]: ...
    @property
    def norm(self) -> float: ...
    @property
    def ratio(self) -> float: ...
    @property
    def tail_bound(self) -> float: ...
    @property
    def error(self) -> float: ...


def image(pixels: Any, title: str = "") -> str:
    """An array (height, width, 3) as an image inside of HTML."""
    array = np.ascontiguousarray(np.asarray(pixels, np.float32).view(np.ndarray))
    step = max(1, math.ceil(max(array.shape[:2]) / MOST))
    if step > 1:
        height, width = (n // step * step for n in array.shape[:2])
        array = array[:height, :width].reshape(height // step, step, width // step, step, 3).mean((1, 3))
        array = np.ascontiguousarray(array, np.float32)
    code = base64.b64encode(_native.encode_png(array, 0.0)).decode()
    return f'<img src="data:image/png;base64,{code}" alt="{html.escape(title, quote=True)}"/>'


def table(head: list[str], rows: list[list[str]]) -> str:
    """A table; cells are texts."""

    def cells(kind: str, row: list[str]) -> str:
        return "".join(f"<{kind}>{html.escape(cell)}</{kind}>" for cell in row)

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return f"<table><thead><tr>{cells('th', head)}</tr></thead><tbody>{body}</tbody></table>"


def picture(pixels: Any, said: str) -> str:
    """A picture, and what is said of it."""
    return f"<figure>{image(pixels, said)}<figcaption>{html.escape(said)}</figcaption></figure>"


def scene(held: _native.Scene, said: str) -> str:
    """A quick picture of a scene, and what is said of it."""
    try:
        asked = arguments.run(0, None, None)
        pair = arguments.transport(None, None, None, held.transport())
        system = _native.assemble(held, pair, arguments.fineness(500, 32), False, asked)
        series = _native.first_terms(system, 2, 3)
        pixels = arguments.pixels((PREVIEW, PREVIEW), 16)
        return picture(_native.solution_picture(system, series, held, pixels, asked)[0], said)
    except Exception:  # A scene without light has no picture, and a notebook shows its words.
        return f"<p>{html.escape(said)}</p>"


def number(value: float) -> str:
    """A number to four digits; nothing where there is none."""
    return "" if math.isnan(value) else f"{value:.4g}"


def solution(terms: Sequence[Term], said: str) -> str:
    """What is said of a solution, and the table of its bounces."""
    return f"<p>{html.escape(said)}</p>{bounces(terms)}"


def bounces(terms: Sequence[Term]) -> str:
    """The table of the first terms of a series."""
    head = ["term", "R, W", "G, W", "B, W", "norm", "ratio", "all later, at most", "error"]
    most = 20
    rows = [
        [
            "E" if b.n == 0 else f"K{'' if b.n == 1 else b.n}E",
            *(number(float(watts)) for watts in b.power),
            number(b.norm),
            number(b.ratio),
            number(b.tail_bound),
            "" if math.isnan(b.error) else f"{100 * b.error:.2f} %",
        ]
        for b in terms[:most]
    ]
    more = f"<p>and {len(terms) - most} more</p>" if len(terms) > most else ""
    return f"{table(head, rows)}{more}"


def factors(
    names: list[str], matrix: npt.NDArray[np.float64], last: Sequence[tuple[str, npt.NDArray[np.float64]]]
) -> str:
    """The matrix, rows and columns named, and the last columns; its first rows and columns where they are many."""
    most = 20
    rows = []
    for i, name in enumerate(names[:most]):
        rows.append([name, *(f"{x:.5f}" for x in (*matrix[i, :most], *(values[i] for _, values in last)))])
    more = f"<p>{most} of {len(names)} objects</p>" if len(names) > most else ""
    return table(["from", *names[:most], *(name for name, _ in last)], rows) + more
