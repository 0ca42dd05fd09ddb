"""Takes the pictures that docs/python.md shows from the notebooks, as they were stored when these were last run.

    jupyter nbconvert --to notebook --execute --inplace python/notebooks/*.ipynb
    python python/notebooks/to_docs.py
"""

from __future__ import annotations

import base64
from pathlib import Path

import nbformat

NOTEBOOKS = Path(__file__).resolve().parent
DOCS = NOTEBOOKS.parents[1] / "docs"

#: Numbers of the pictures of each notebook that are shown.
SHOWN = {"1": [1, 4], "2": [1, 2], "3": [1, 2], "4": [1], "5": [1, 3]}


def main() -> None:
    """Writes docs/notebook-N-K.png."""
    for path in sorted(NOTEBOOKS.glob("*.ipynb")):
        cells = nbformat.read(path, 4).cells
        outputs = [output.get("data", {}) for cell in cells for output in cell.get("outputs", [])]
        pictures = [data["image/png"] for data in outputs if "image/png" in data]
        for k in SHOWN[path.name[0]]:
            (DOCS / f"notebook-{path.name[0]}-{k}.png").write_bytes(base64.b64decode(pictures[k - 1]))


if __name__ == "__main__":
    main()
