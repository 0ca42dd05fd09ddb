"""What Python costs: products with K against Rust and SciPy, pictures against the program, memory of views.

    python python/benches/overheads.py [PATCHES RAYS]

Needs the program and the example built: cargo build --release --bins --example product. Runs of both sides alternate;
ratios are of medians.
"""

from __future__ import annotations

import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import scipy.sparse

import halflight as hl

ROOT = Path(__file__).resolve().parents[2]
RELEASE = ROOT / "target" / "release"


def median(run: Callable[[], object], times: int = 15) -> float:
    """Median seconds of some runs."""

    def once() -> float:
        start = time.perf_counter()
        run()
        return time.perf_counter() - start

    return statistics.median(once() for _ in range(times))


def mib() -> float:
    """Memory that the process holds now, MiB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2**20


def products(patches: int, rays: int) -> None:
    """K x here, in Rust, and by SciPy."""
    K = hl.solve(hl.cornell_box(), mode="global", patches=patches, rays=rays, bounces=1).operator
    x = K.first_bounce.ravel()
    command = [str(RELEASE / "examples" / "product"), "cornell-box", str(patches), str(rays)]
    rust, ours = [], []
    for _ in range(3):
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        rust.append(float(done.stdout.split()[2]))
        ours.append(median(lambda: K.matvec(x)))
    print(f"{len(K.patches)} patches, {K.F.nnz} entries of F")
    print(f"K.matvec {statistics.median(ours):.4f} s, in Rust {statistics.median(rust):.4f} s: ", end="")
    print(f"{statistics.median(ours) / statistics.median(rust):.3f}")

    F, rho, alpha = K.F, K.patches.rho, K.patches.alpha[:, None]

    def by_scipy() -> object:
        visible = rho * (F @ x.reshape(-1, 2, 3)[:, 0])
        return np.stack([alpha * visible, visible], axis=1)

    one = scipy.sparse.csr_array(F)
    column = np.ascontiguousarray(x.reshape(-1, 2, 3)[:, 0, 0])
    ours_now, theirs, single = median(lambda: K.matvec(x)), median(by_scipy), median(lambda: one @ column)
    print(f"scipy, three channels at once {theirs:.4f} s: {theirs / ours_now:.2f} times as long")
    print(f"scipy, channel by channel {3 * single:.4f} s: {3 * single / ours_now:.2f} times as long")

    before = mib()
    held = [(K.F, K.emission, K.patches.rho) for _ in range(10)]
    print(f"{len(held)} views of F ({F.data.nbytes / 2**20:.0f} MiB of values): {mib() - before:.1f} MiB more")


def pictures() -> None:
    """Pictures here and by the program, whose start and reading of the scene count on both sides."""
    box = hl.cornell_box()
    here, there = [], []
    with tempfile.TemporaryDirectory() as folder:
        out = str(Path(folder) / "a.exr")
        command = [
            str(RELEASE / "halflight"),
            *["render", "cornell-box", "--mode", "global", "--size", "256x256", "--tolerance", "0.02", "-o"],
            out,
        ]
        for _ in range(7):
            there.append(median(lambda: subprocess.run(command, capture_output=True, check=True), 1))
            here.append(
                median(lambda: hl.render(box, mode="global", size=(256, 256), tolerance=0.02).save(out), 1),
            )
    a, b = statistics.median(here), statistics.median(there)
    print(f"render and save {a:.3f} s, the program {b:.3f} s: {a / b:.3f}")


if __name__ == "__main__":
    size = [int(number) for number in sys.argv[1:3]] or [100_000, 64]
    products(*size)
    pictures()
