"""Rays per second of halflight and of Embree on one thread, on the same triangles and rays.

    pip install embreex numpy
    python benches/against_embree.py [FILE.obj ...]

Runs `cargo bench --bench rates`, which measures halflight and writes triangles and rays, and casts the same rays through Embree
(`embreex`): closest hits by single-ray queries, visibility by occlusion queries of the segments' length. Embree knows no plane
to skip: its rays start 1e-5 off their face, and its segments end as far from theirs.

Each slice of rays counts by the best of some passes, as in `benches/rates.rs`: other work on the machine only slows them down.
Ratios above 1 mean that halflight is faster.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

SLICE = 1000
RUNS = 7


def halflight(folder, files):
    command = ["cargo", "bench", "--bench", "rates", "--", "--dump", str(folder), *files]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, cwd=Path(__file__).parent.parent)
    return json.loads(done.stdout)


def vectors(folder, name, kind):
    return np.fromfile(folder / f"{name}.{kind}", "<f4").reshape(-1, 3)


def rate(rays, run):
    """Of single-threaded runs over parts of the rays, given as arrays of equal length."""
    parts = [[np.ascontiguousarray(a[k : k + SLICE]) for a in rays] for k in range(0, len(rays[0]), SLICE)]
    best = np.full(len(parts), np.inf)
    for _ in range(RUNS):
        for k, part in enumerate(parts):
            start = time.perf_counter()
            run(*part)
            best[k] = min(best[k], time.perf_counter() - start)
    return 1e-6 * len(rays[0]) / best.sum()


def embree(folder, name):
    triangles = vectors(folder, name, "triangles").reshape(-1, 3, 3)
    start = time.perf_counter()
    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, triangles)
    first = vectors(folder, name, "rays")[:2]
    scene.run(first[:1], first[1:])
    build = time.perf_counter() - start
    rays = vectors(folder, name, "rays").reshape(-1, 2, 3)
    ends = vectors(folder, name, "segments").reshape(-1, 2, 3)
    across = ends[:, 1] - ends[:, 0]
    lengths = np.linalg.norm(across, axis=1)
    found = {"build": build}
    found["closest"] = rate([rays[:, 0], rays[:, 1]], scene.run)
    directions = across / np.maximum(lengths, 1e-20)[:, None]
    occluded = lambda o, d, lengths: scene.run(o, d, lengths, query="OCCLUDED")
    found["visible"] = rate([ends[:, 0], directions, lengths], occluded)
    return found


def main():
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        print(f"{'scene':>12} {'triangles':>9} {'':>8} {'halflight':>10} {'Embree':>8} {'ratio':>6}   (Mrays/s)")
        for own in halflight(folder, [str(Path(f).resolve()) for f in sys.argv[1:]]):
            other = embree(folder, own["name"])
            for kind in ("closest", "visible"):
                a, b = own[kind], other[kind]
                print(f"{own['name']:>12} {own['triangles']:9} {kind:>8} {a:10.2f} {b:8.2f} {a / b:6.2f}")
            print(f"{own['name']:>12} {own['triangles']:9} {'crossings':>8} {own['crossings']:10.2f}")


main()
