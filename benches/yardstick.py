#!/usr/bin/env python3
"""The yardstick of the program: true error, stated error and CPU seconds of scenes, tolerances and seeds.

    python3 benches/yardstick.py run -o TABLE.json [--program P] [--tolerance 0.05,0.02] [--seeds 3] [FOLDER ...]
    python3 benches/yardstick.py compare BEFORE.json AFTER.json

Needs, and installs none of it: Python 3.11, `numpy` and `OpenEXR` (both from PyPI), and a release build of halflight.

`run` renders the built-in scenes, those of tests/data/hard, and every FOLDER/NAME/NAME.toml that has references beside
it: either reference.exr, reference_se.exr (standard error of each value) and mask.exr (1 where no luminaire is seen), or
a.exr and b.exr, two independent estimates, with mask.exr. References of built-in scenes are made once by the program's
own path tracer, of two seeds, and kept in target/yardstick. Sizes are the references'.

True error, relative to the RMS of the reference R over the mask's pixels and channels, free of the reference's noise:
error^2 = mean((I - R)^2 - se^2) / mean(R^2), or mean((I - a)(I - b)) / mean(a b). Each has a standard error over
pixels; what is below twice it is told as such (`floor`). CPU seconds are user and system of the whole process.

`compare` tells, for every scene and tolerance, medians over seeds before and after: true/stated, true/asked, and the
ratio of CPU seconds as they are and at equal true error, where what the program before would have taken for the error
after is read from its own tolerances along straight lines in log-log, beyond them by the square of the error.
"""

import argparse
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HOME = Path(__file__).resolve().parent.parent
BUILT_IN = ("cornell-box", "furnace", "concentric-spheres", "furnished-room", "two-rooms")
BUILT_IN_SIZE = "128x128"
BUILT_IN_SAMPLES = 4096


def read(path):
    """Linear radiance of an EXR file as an array (height, width, 3)."""
    import numpy as np
    import OpenEXR

    channels = OpenEXR.File(str(path)).channels()
    for name in ("RGB", "RGBA"):
        if name in channels:
            return np.asarray(channels[name].pixels, dtype=float)[..., :3]
    if "Y" in channels:
        return np.repeat(np.asarray(channels["Y"].pixels, dtype=float)[..., None], 3, -1)
    return np.stack([np.asarray(channels[c].pixels, dtype=float) for c in "RGB"], -1)


class Reference:
    """What a picture is compared with: two estimates whose errors are independent, or one with its standard error."""

    def __init__(self, folder):
        self.pair = (folder / "a.exr").exists()
        names = ("a", "b") if self.pair else ("reference", "reference_se")
        self.first, self.second = (read(folder / f"{name}.exr") for name in names)
        self.mask = read(folder / "mask.exr")[..., 0] > 0.5
        self.size = f"{self.mask.shape[1]}x{self.mask.shape[0]}"

    def error(self, picture):
        """True error of a picture and the least that can be told from the reference's noise (two standard errors)."""
        import numpy as np

        image, first, second = (array[self.mask] for array in (picture, self.first, self.second))
        if self.pair:
            squares, signal = (image - first) * (image - second), np.mean(first * second)
        else:
            squares, signal = (image - first) ** 2 - second**2, np.mean(first**2 - second**2)
        by_pixel = squares.mean(-1) / signal
        noise = 2 * by_pixel.std() / math.sqrt(by_pixel.size)
        return math.sqrt(max(0.0, by_pixel.mean())), math.sqrt(noise)


def make_reference(program, scene, folder):
    """References of a built-in scene by path tracing of two seeds."""
    folder.mkdir(parents=True, exist_ok=True)
    for seed, name in enumerate("ab"):
        command = [program, "trace", scene, "--mode", "global", "--size", BUILT_IN_SIZE, "--seed", str(seed + 1000)]
        command += ["--samples", str(BUILT_IN_SAMPLES), "--out", str(folder), "-o", str(folder / f"{name}.exr"), "-q"]
        subprocess.run(command, check=True)
    write_mask(folder)


def write_mask(folder):
    """mask.exr beside a.exr and b.exr: 0 where both agree exactly, which see luminaires, and in the pixels around."""
    import numpy as np
    import OpenEXR

    pictures = [read(folder / f"{name}.exr") for name in "ab"]
    own = np.pad((pictures[0] == pictures[1]).all(-1) & (pictures[0] > 0).any(-1), 1)
    height, width = pictures[0].shape[:2]
    around = np.any([own[y : y + height, x : x + width] for y in range(3) for x in range(3)], axis=0)
    channels = {"RGB": np.repeat((~around)[..., None], 3, -1).astype(np.float32)}
    OpenEXR.File({}, channels).write(str(folder / "mask.exr"))


def scenes(program, folders, only):
    """(name, what the program is given, folder of the references) of every scene."""
    for scene in BUILT_IN:
        if not only or scene in only:
            folder = HOME / "target" / "yardstick" / scene
            if not (folder / "mask.exr").exists():
                make_reference(program, scene, folder)
            yield scene, scene, folder
    for folder in [HOME / "tests" / "data" / "hard", *map(Path, folders)]:
        for path in sorted(folder.glob("*/mask.exr")):
            name = path.parent.name
            if not only or name in only:
                yield name, str(path.parent / f"{name}.toml"), path.parent


def render(program, given, size, tolerance, seed, extra, limit):
    """One run: the picture and what the program says of it, with CPU and wall seconds and peak memory in MB."""
    with tempfile.TemporaryDirectory() as out:
        picture = f"{out}/picture.exr"
        command = [program, "render", given, "--mode", "global", "--size", size, "--tolerance", str(tolerance)]
        command += ["--seed", str(seed), "-o", picture, "--out", out, "--json", *extra]
        start = time.monotonic()
        with open(f"{out}/report", "w+") as report, open(f"{out}/said", "w+") as said:
            process = subprocess.Popen(command, stdout=report, stderr=said)
            while True:
                pid, status, usage = os.wait4(process.pid, os.WNOHANG)
                if pid:
                    break
                if time.monotonic() - start > limit:
                    process.kill()
                    os.wait4(process.pid, 0)
                    return None, {"wall": limit, "why": "not done in time"}
                time.sleep(0.005)
            took = {"cpu": usage.ru_utime + usage.ru_stime, "wall": time.monotonic() - start, "mb": usage.ru_maxrss // 1024}
            report.seek(0)
            said.seek(0)
            if status:
                return None, {**took, "why": said.read()[-300:]}
            return read(picture), {**took, **json.load(report)["modes"][0]}


def run(options):
    rows = []
    for name, given, folder in scenes(options.program, options.folders, options.only):
        reference = Reference(folder)
        for tolerance in options.tolerance:
            for seed in range(options.seeds):
                row = {"scene": name, "tolerance": tolerance, "seed": seed}
                picture, report = render(
                    options.program, given, reference.size, tolerance, seed, options.extra.split(), options.limit
                )
                row |= {key: report.get(key) for key in ("cpu", "wall", "mb", "patches", "rays", "met", "why")}
                if picture is not None:
                    row["true"], row["floor"] = reference.error(picture)
                    row["stated"] = report["error"]["total"]
                rows.append(row)
                print(line(row), flush=True)
                Path(options.output).write_text(json.dumps(rows, indent=1))


def line(row):
    told = f"{row['scene']:24} {100 * row['tolerance']:4g} % seed {row['seed']}"
    if "true" not in row:
        return f"{told}  {row['why']}"
    stated = math.inf if row["stated"] is None else row["stated"]
    sure = max(0.0, row["true"] ** 2 - row["floor"] ** 2) ** 0.5
    wrong = row["met"] and (sure > 1.1 * row["tolerance"] or sure > 1.2 * stated)
    return (
        f"{told}  true {100 * row['true']:6.2f} ({100 * row['floor']:.2f})  stated {100 * stated:6.2f}"
        f"  cpu {row['cpu']:6.2f}  wall {row['wall']:6.2f}  {row['mb']} MB{'' if row['met'] else '  not met'}"
        f"{'  WRONG' if wrong else ''}"
    )


def medians(path):
    """Medians over seeds of a table: {scene: {tolerance: {quantity: value}}}."""
    groups = {}
    for row in json.loads(Path(path).read_text()):
        if "true" in row:
            groups.setdefault(row["scene"], {}).setdefault(row["tolerance"], []).append(row)
    of = lambda rows, key: statistics.median(math.inf if r[key] is None else r[key] for r in rows)
    return {
        scene: {t: {key: of(rows, key) for key in ("true", "stated", "cpu")} for t, rows in by.items()}
        for scene, by in groups.items()
    }


def seconds_for(before, error, tolerance):
    """CPU seconds that the program before would have taken for an error, from its own tolerances."""
    points = sorted((row["true"], row["cpu"]) for row in before.values() if row["true"] > 0)
    for (e0, c0), (e1, c1) in zip(points, points[1:]):
        if e0 <= error <= e1:
            share = math.log(error / e0) / math.log(e1 / e0) if e1 > e0 else 0.5
            return c0 * (c1 / c0) ** share
    at = before[tolerance]
    return at["cpu"] * (at["true"] / error) ** 2 if min(at["true"], error) > 0 else at["cpu"]


def compare(options):
    before, after = medians(options.before), medians(options.after)
    ratios, equal = [], []
    print(f"{'scene':24} {'asked':>6} {'true':>15} {'stated':>15} {'CPU s':>17} {'ratio':>6} {'equal':>6}")
    for scene in after:
        for t in sorted(set(after[scene]) & set(before.get(scene, {})), reverse=True):
            b, a = before[scene][t], after[scene][t]
            ratios.append(a["cpu"] / b["cpu"])
            equal.append(a["cpu"] / seconds_for(before[scene], a["true"], t))
            print(
                f"{scene:24} {100 * t:6g} {100 * b['true']:6.2f} -> {100 * a['true']:5.2f} {100 * b['stated']:6.2f} ->"
                f" {100 * a['stated']:5.2f} {b['cpu']:7.2f} -> {a['cpu']:6.2f} {ratios[-1]:6.2f} {equal[-1]:6.2f}"
            )
    if ratios:
        print(f"median ratio of CPU seconds {statistics.median(ratios):.3f}, at equal error {statistics.median(equal):.3f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    one = commands.add_parser("run")
    one.add_argument("folders", nargs="*")
    one.add_argument("-o", "--output", required=True)
    one.add_argument("--program", default=str(HOME / "target" / "release" / "halflight"))
    one.add_argument("--tolerance", type=lambda text: [float(t) for t in text.split(",")], default=[0.05, 0.02])
    one.add_argument("--seeds", type=int, default=3)
    one.add_argument("--only", type=lambda text: text.split(","), help="names of scenes, by commas")
    one.add_argument("--extra", default="", help="more options of `render`")
    one.add_argument("--limit", type=float, default=240, help="seconds after which a run is ended")
    one.set_defaults(does=run)
    two = commands.add_parser("compare")
    two.add_argument("before")
    two.add_argument("after")
    two.set_defaults(does=compare)
    options = parser.parse_args()
    options.does(options)


if __name__ == "__main__":
    sys.exit(main())
