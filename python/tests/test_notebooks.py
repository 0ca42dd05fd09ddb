"""What notebooks have stored."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def stored() -> Iterator[tuple[str, bytes]]:
    """The pictures of all notebooks, and those of the pages."""
    nbformat = pytest.importorskip("nbformat")
    for path in sorted((ROOT / "python" / "notebooks").glob("*.ipynb")):
        for cell in nbformat.read(path, 4).cells:
            for output in cell.get("outputs", []):
                if png := output.get("data", {}).get("image/png"):
                    yield path.stem, base64.b64decode(png)
    for path in sorted((ROOT / "docs").glob("notebook-*.png")):
        yield path.stem, path.read_bytes()


def test_pictures_have_24_bits() -> None:
    found = list(stored())
    assert len(found) > 15
    for name, png in found:
        # IHDR: 8 bits a sample, colour type 2 (red, green, blue without alpha).
        assert png[:8] == b"\x89PNG\r\n\x1a\n" and (png[24], png[25]) == (8, 2), name


def test_pages_show_what_notebooks_have_stored() -> None:
    found = list(stored())
    of_notebooks = {png for name, png in found if not name.startswith("notebook-")}
    assert all(png in of_notebooks for name, png in found if name.startswith("notebook-"))
