"""Stores the notebooks' pictures in 24 bits, without alpha, and takes those from them that docs/python.md shows; leaves
out of the notebooks when and by which Python they were run.

    jupyter nbconvert --to notebook --execute --inplace python/notebooks/*.ipynb
    python python/notebooks/to_docs.py

Pictures are those of the last run.
"""

from __future__ import annotations

import base64
import io
from pathlib import Path

import nbformat
from PIL import Image

NOTEBOOKS = Path(__file__).resolve().parent
DOCS = NOTEBOOKS.parents[1] / "docs"

#: Numbers of the pictures of each notebook that are shown.
SHOWN = {"1": [1, 4], "2": [1, 2], "3": [1, 2], "4": [1], "5": [1, 3]}


def opaque(png: bytes) -> bytes:
    """A PNG file as one of 24 bits, before white where it is transparent."""
    picture = Image.open(io.BytesIO(png)).convert("RGBA")
    picture = Image.alpha_composite(Image.new("RGBA", picture.size, "white"), picture).convert("RGB")
    held = io.BytesIO()
    picture.save(held, "PNG", optimize=True)
    return held.getvalue()


def main() -> None:
    """Writes the notebooks, and docs/notebook-N-K.png."""
    for path in sorted(NOTEBOOKS.glob("*.ipynb")):
        notebook = nbformat.read(path, 4)
        outputs = [output.get("data", {}) for cell in notebook.cells for output in cell.get("outputs", [])]
        pictures = []
        for data in outputs:
            if "image/png" in data:
                pictures.append(opaque(base64.b64decode(data["image/png"])))
                data["image/png"] = base64.b64encode(pictures[-1]).decode() + "\n"
        for cell in notebook.cells:
            cell.metadata.pop("execution", None)
        notebook.metadata["language_info"] = {"file_extension": ".py", "name": "python"}
        nbformat.write(notebook, path)
        for k in SHOWN[path.name[0]]:
            (DOCS / f"notebook-{path.name[0]}-{k}.png").write_bytes(pictures[k - 1])


if __name__ == "__main__":
    main()
