"""Reads what halflight exports by the tools it is meant for, and says what agrees; any disagreement is an error.

    python read.py FOLDER

FOLDER holds `kept` (a folder of --save with ply and mtx), `factors` (what `halflight factors` wrote), and x.npy, y.npy,
rho.npy, alpha.npy: light on the patches, K of it by halflight, and what the patches are made of.
"""

import json
import sys
from pathlib import Path

import numpy
import pandas
import scipy.io
import scipy.sparse
import trimesh

folder = Path(sys.argv[1])
kept = folder / "kept"
meta = json.loads((kept / "meta.json").read_text())


def same(what, a, b, relative=1e-6):
    a, b = numpy.asarray(a, dtype=float), numpy.asarray(b, dtype=float)
    assert a.shape == b.shape, f"{what}: {a.shape} {b.shape}"
    assert numpy.abs(a - b).max() <= relative * numpy.abs(b).max(), f"{what}: {numpy.abs(a - b).max()}"
    print("ok", what)


# K x in scipy against halflight's.
F = scipy.sparse.load_npz(kept / "F.npz")
patches = meta["patches"]["count"]
assert F.shape == (patches, patches) and F.format == "csr" and F.has_canonical_format
x, y, rho, alpha = (numpy.load(folder / f"{name}.npy") for name in ["x", "y", "rho", "alpha"])
seen = rho * (F @ x[:, 0, :])
same("K x", numpy.stack([alpha[:, None] * seen, seen], axis=1), y)

same("Matrix Market", scipy.io.mmread(kept / "F.mtx").toarray(), F.toarray(), 0.0)

# L is the sum of its terms, and fulfils L = E + K L where the series has ended.
L, terms = numpy.load(kept / "L.npy"), numpy.load(kept / "terms.npy")
assert L.dtype == terms.dtype == numpy.float32 and L.shape == (patches, 2, 3) and terms.shape[1:] == L.shape
same("the sum of the terms", terms.sum(axis=0), L, 1e-5)
same("a term is K of the one before", terms[3][:, 1], rho * (F @ terms[2][:, 0]))

# The patches with their light.
try:
    import pyvista

    grid = pyvista.read(kept / "patches.vtu")
    points, cells, data = grid.points, grid.cells.reshape(-1, 4)[:, 1:], grid.cell_data
    print("ok pyvista")
except ImportError:
    import meshio

    grid = meshio.read(kept / "patches.vtu")
    points, cells = grid.points, grid.cells_dict["triangle"]
    data = {name: arrays[0] for name, arrays in grid.cell_data.items()}
    print("ok meshio")
patch = numpy.asarray(data["patch"]).reshape(-1)
same("light on cells", data["L"], L[patch, 1], 0.0)
same("bounces on cells", data["bounce_1"], terms[1][patch, 1], 0.0)
same("reflectance on cells", data["rho"], rho[patch], 0.0)
corners = numpy.asarray(points)[cells]
areas = 0.5 * numpy.linalg.norm(numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
own = numpy.zeros(patches)
numpy.add.at(own, patch, areas)
first = numpy.unique(patch, return_index=True)
same("areas", numpy.asarray(data["area"])[first[1]], own[first[0]], 1e-4)

mesh = trimesh.load(kept / "patches.ply", process=False)
same("corners of the PLY", mesh.vertices[mesh.faces], corners, 1e-6)
linear = numpy.clip(L[patch, 1], 0, 1)
srgb = numpy.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
codes = numpy.asarray(mesh.visual.vertex_colors)[mesh.faces[:, 0], :3]
assert numpy.abs(codes - 255 * srgb).max() < 0.51
print("ok colours")

# Form factors between objects, and between patches.
factors = folder / "factors"
table = pandas.read_csv(factors / "squares-factors-matrix.csv", index_col=0)
arrays = numpy.load(factors / "squares-factors.npz")
assert list(table.index) == list(arrays["rows"]) and list(table.columns) == list(arrays["columns"])
assert list(table.index) == ["low", "high, with comma"]
same("the table", table.to_numpy(), arrays["F"], 1e-15)
assert abs(table.loc["low", "high, with comma"] - 0.1998248956983874) < 1e-9
residuals = pandas.read_csv(factors / "squares-factors-residuals.csv", index_col="object")
same("closure", residuals["closure"], 1 - arrays["F"].sum(axis=1), 1e-9)
between = scipy.sparse.load_npz(factors / "squares-patch-factors.npz")
arrays = numpy.load(factors / "squares-patch-factors.npz")
same("closure of patches", 1 - numpy.asarray(between.sum(axis=1)).ravel(), arrays["closure"], 1e-6)
low, high = (numpy.flatnonzero(arrays["object"] == number) for number in [0, 1])
area = arrays["area"]
mean = (area[low] @ between[low][:, high].sum(axis=1)).item() / area[low].sum()
assert abs(mean - 0.1998248956983874) < 2e-3, mean
print("ok patch factors")
