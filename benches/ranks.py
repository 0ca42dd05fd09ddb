#!/usr/bin/env python3
"""What several processes by MPI cost: CPU and wall seconds, and memory of the largest, of one command.

    python3 benches/ranks.py [--program P] [--ranks 1,2,4] [--threads 1,2] [--repeat 3] -- COMMAND ARGUMENTS ...

Needs a build with the feature `mpi`, and `mpirun`. Runs the command alone with each number of threads, then by each
number of ranks of one thread; medians of the repetitions, which are interleaved. CPU seconds are user and system of all
processes, mpirun's among them; memory is the largest resident set of one process. What is over is CPU seconds over
those of one thread, and wall seconds over those of as many threads where there are as many.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time

MPI = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
}


def measure(command):
    """CPU seconds, wall seconds and the largest resident set (MB) of a command and all that it starts."""
    with tempfile.TemporaryDirectory() as out:
        began = time.perf_counter()
        process = subprocess.Popen(
            [word.replace("OUT", out) for word in command],
            env=os.environ | MPI,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
        )
        said = process.stderr.read()
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - began
    if status != 0:
        sys.exit(f"{' '.join(command)}:\n{said.decode()}")
    return usage.ru_utime + usage.ru_stime, wall, usage.ru_maxrss / 1024


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--program", default="target/release/halflight")
    parser.add_argument("--ranks", default="1,2,4")
    parser.add_argument("--threads", default="1,2")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("command", nargs="+", help="a command of halflight; OUT is a directory for what it writes")
    asked = parser.parse_args()
    ways = [("threads", int(n), []) for n in asked.threads.split(",")]
    ways += [("ranks", int(n), ["mpirun", "--bind-to", "none", "-n", n]) for n in asked.ranks.split(",")]
    found = {way[:2]: [] for way in ways}
    for _ in range(asked.repeat):
        for kind, count, start in ways:
            threads = ["--threads", str(count if kind == "threads" else 1), "--quiet"]
            found[kind, count].append(measure([*start, asked.program, *asked.command, *threads]))
    medians = {way: [statistics.median(column) for column in zip(*runs)] for way, runs in found.items()}
    print("| | CPU s | over one thread | wall s | over as many threads | MB of the largest |\n|---|---|---|---|---|---|")
    alone = medians["threads", 1][0]
    for (kind, count), (cpu, wall, size) in medians.items():
        beside = medians.get(("threads", count))
        over = f"{wall / beside[1]:.2f}" if kind == "ranks" and beside else ""
        name = f"{count} {kind if count > 1 else kind[:-1]}"
        print(f"| {name} | {cpu:.2f} | {cpu / alone:.2f} | {wall:.2f} | {over} | {size:.0f} |")


if __name__ == "__main__":
    main()
