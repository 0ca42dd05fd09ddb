"""What notebooks show of objects: HTML without a network."""

from __future__ import annotations

import base64
import html
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from halflight import _native

if TYPE_CHECKING:
    from halflight._factors import Factors
    from halflight._scene import Scene
    from halflight._solution import Solution

#: Pixels along the longer side that are shown at most, and of a scene's preview.
MOST = 1024
PREVIEW = 192


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


def scene(own: Scene) -> str:
    """A quick picture, and what the scene holds."""
    words = repr(own).strip("<>")
    try:
        from halflight._solution import solve

        solved = solve(own, patches=500, rays=32, bounces=2)
        return picture(solved.picture(size=(PREVIEW, PREVIEW), samples=16), words)
    except Exception:  # A scene without light has no picture, and a notebook shows its words.
        return f"<p>{html.escape(words)}</p>"


def number(value: float) -> str:
    """A number to four digits; nothing where there is none."""
    return "" if math.isnan(value) else f"{value:.4g}"


def solution(own: Solution) -> str:
    """The table of bounces."""
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
        for b in own.bounces[:most]
    ]
    more = f"<p>and {len(own.bounces) - most} more</p>" if len(own.bounces) > most else ""
    return f"<p>{html.escape(repr(own).strip('<>'))}</p>{table(head, rows)}{more}"


def factors(own: Factors) -> str:
    """The matrix, rows and columns named; its first rows and columns where they are many."""
    most = 20
    names = own.names[:most] + (["sky"] if own.sky is not None else [])
    rows = []
    for i, name in enumerate(own.names[:most]):
        sky = [] if own.sky is None else [f"{own.sky[i]:.5f}"]
        rows.append([name, *(f"{x:.5f}" for x in own.matrix[i, :most]), *sky])
    more = f"<p>{most} of {len(own.names)} objects</p>" if len(own.names) > most else ""
    return table(["from", *names], rows) + more
