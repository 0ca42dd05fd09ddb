#!/usr/bin/env python3
"""Time and memory of a solve for L by several processes: a model, its constants, and what it foretells.

    python3 benches/scale.py measure [--program P]      the constants, from four solves alone
    python3 benches/scale.py check [--program P]        the model against solves by 1, 2 and 4 ranks
    python3 benches/scale.py foretell                   10^6 to 10^8 patches on 16, 256 and 4,096 ranks

n patches with e entries a row of F, R rays cast in all, P products (power iteration and series), N ranks of c threads:

    seconds  = (R ray + n row) / (N c) + P (n e entry / (N c) + n vector + 16 n / network + latency log2 N) + n patch
    bytes    = n (e stored / N + own) + program

CPU seconds on one machine, which `check` compares, are those of work shared out once and of the rest N times. Constants
are of this machine; network and latency of clusters are assumptions, and so is that c threads are c times as fast.
"""

import argparse
import json
import math
import os
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass, fields
from pathlib import Path

from ranks import MPI, measure

SCENE, PRODUCTS = "furnished-room", 97


@dataclass
class Constants:
    """Seconds and bytes; `measure` prints them."""

    ray: float = 228e-9  # a ray of F, and its place in a row
    row: float = 14.2e-6  # a row of F besides
    entry: float = 1.13e-9  # an entry of F, times four numbers
    vector: float = 47e-9  # what is done with a patch's numbers after a product, by every rank
    patch: float = 1.4e-6  # a patch: cutting it, and its light in a picture, by every rank
    start: float = 0.15  # MPI's, for each rank
    stored: float = 14.1  # bytes of an entry, while rows are joined
    own: float = 2070.0  # bytes of a patch with every rank
    program: float = 14e6


@dataclass
class Cluster:
    """What is assumed of one."""

    threads: int = 32
    network: float = 12.5e9  # bytes a second into a rank: 100 Gbit/s
    latency: float = 2e-6
    share: float = 1.0  # of the time that vectors take with one thread


def command(patches, rays, out):
    words = ["render", SCENE, "--mode", "global", "--patches", str(patches), "--rays", str(rays)]
    return [*words, "--size", "16x16", "--samples", "1", "-o", f"{out}/a.exr"]


def entries(program, patches, rays):
    """Mean entries of a row, as a refusal for want of memory tells them."""
    with tempfile.TemporaryDirectory() as out:
        words = [program, *command(patches, rays, out), "--memory", "0.003"]
        said = subprocess.run(words, capture_output=True, text=True, check=False).stderr
    return int(re.search(r"here of (\d+) entries", said)[1])


def solved(program, patches, rays):
    """The report of a solve by one thread, and its largest resident set."""
    with tempfile.TemporaryDirectory() as out:
        words = [program, *command(patches, rays, out), "--threads", "1", "--json"]
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        report = json.loads(process.stdout.read())
        _, _, usage = os.wait4(process.pid, 0)
    return report, 1024 * usage.ru_maxrss


def measured(program):
    """Constants from two numbers of patches with two numbers of rays each."""
    runs = {(p, r): solved(program, p, r) for p in (12_000, 50_000) for r in (256, 1024)}
    few, many = runs[50_000, 256], runs[50_000, 1024]
    n = many[0]["patches"]
    e = [entries(program, 50_000, r) for r in (256, 1024)]
    ff, solve = [[run[0]["seconds"][k] for run in (few, many)] for k in ("form_factors", "solve")]
    rays = [run[0]["rays"] for run in (few, many)]
    ray = (ff[1] - ff[0]) / (rays[1] - rays[0])
    entry = (solve[1] - solve[0]) / (PRODUCTS * n * (e[1] - e[0]))
    stored = (many[1] - few[1]) / (n * (e[1] - e[0]))
    small = runs[12_000, 256]
    m = small[0]["patches"]
    rest = [small[1] - stored * m * entries(program, 12_000, 256), few[1] - stored * n * e[0]]
    own = (rest[1] - rest[0]) / (n - m)
    seconds = few[0]["seconds"]
    return Constants(
        ray=ray,
        row=(ff[0] - ray * rays[0]) / n,
        entry=entry,
        vector=solve[0] / (PRODUCTS * n) - entry * e[0],
        patch=(seconds["patches"] + seconds["gather"]) / n,
        stored=stored,
        own=own,
        program=rest[0] - own * m,
    )


def check(program, constants):
    """Model and measurement beside each other, for twice as many patches as constants were measured with."""
    patches, rays = 100_000, 1024
    report, _ = solved(program, patches, rays)
    n, cast, e = report["patches"], report["rays"], entries(program, patches, rays)
    c = constants
    once = c.ray * cast + c.row * n + PRODUCTS * n * e * c.entry
    each = n * (PRODUCTS * c.vector + c.patch) + c.start
    print(f"{n} patches, {e} entries a row\n\n| ranks | CPU s | model | MB of the largest | model |\n|---|---|---|---|---|")
    for count in (1, 2, 4):
        start = ["mpirun", "--bind-to", "none", "-n", str(count), program]
        cpu, _, size = measure([*start, *command(patches, rays, "OUT"), "--threads", "1", "--quiet"])
        memory = n * (e * c.stored / count + c.own) + c.program
        print(f"| {count} | {cpu:.1f} | {once + count * each:.1f} | {1.048576 * size:.0f} | {memory / 1e6:.0f} |")


def time_of(value):
    for unit, size in (("min", 60), ("s", 1), ("ms", 1e-3)):
        if value >= size:
            break
    digits = max(0, 1 - math.floor(math.log10(value / size)))
    return f"{value / size:.{digits}f} {unit}"


def foretell(c, cluster, e=700, rays=1024):
    """Cast, products and memory of a rank, where rows have e entries and patches `rays` rays."""
    print("| patches | ranks | F | a product: own rows | vectors | exchange | all of L | a rank's memory |")
    print("|---|---|---|---|---|---|---|---|")
    for n in (10**6, 10**7, 10**8):
        for count in (16, 256, 4096):
            cores = count * cluster.threads
            cast = n * (rays * c.ray + c.row) / cores
            rows, vectors = n * e * c.entry / cores, n * c.vector * cluster.share
            exchange = 16 * n / cluster.network + cluster.latency * math.log2(count)
            whole = cast + PRODUCTS * (rows + vectors + exchange) + n * c.patch
            memory = n * (e * c.stored / count + c.own) + c.program
            row = [f"10^{round(math.log10(n))}", f"{count:,}", *map(time_of, (cast, rows, vectors, exchange, whole))]
            print("| " + " | ".join([*row, f"{memory / 1e9:.1f} GB"]) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("task", choices=("measure", "check", "foretell"))
    parser.add_argument("--program", default=str(Path("target/release/halflight")))
    asked = parser.parse_args()
    os.environ.update(MPI)
    if asked.task == "measure":
        found = measured(asked.program)
        for field in fields(found):
            print(f"{field.name:8} {getattr(found, field.name):.3g}")
    elif asked.task == "check":
        check(asked.program, Constants())
    else:
        foretell(Constants(), Cluster())


if __name__ == "__main__":
    sys.exit(main())
