#!/usr/bin/env python3
"""Light at points: halflight against Radiance's rtrace, at equal true error, in one run.

Needs Python 3.11, `pyradiance` and `numpy` (both from PyPI) and a release build of halflight.

    cargo build --release
    python3 benches/against_rtrace.py [--points 10000] [--program target/release/halflight]

The furnished room, all surfaces diffuse, the lamp without reflection: `plastic` without specular part, `light` with Ke
for the lamp; polygons as the OBJ has them. Points lie on a grid 0.8 over the floor; those inside of solids, as
halflight reports them, have no part in the error.

With interpolation (--settings 0.3,256,64) rtrace did not end 24 bounces at 10,000 points within five minutes; without,
its time is measured at the sample and is in proportion to the points.

The reference is rtrace without interpolation (-aa 0) at a sample of the points and many rays: neither program's own
answer at the settings compared, and one of another method than halflight's. Error: RMS over the sample of the relative
difference of the mean of the channels, the reference's standard error (from two runs, whose rays differ) taken off in
squares. CPU seconds are user and system time of the program's process: rtrace's with the octree ready; halflight's from
reading the scene to the table, less those of the same run with the points taken out, for it renders a picture as well.
"""

import argparse
import csv
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HOME = Path(__file__).resolve().parent.parent
# Ambient accuracy, divisions and super-samples.
SETTINGS = ["0,256,0", "0,512,0", "0,1024,0"]
# The room passes on four fifths of all light, so 24 bounces leave out 0.4 % of what is reflected, 60 nothing.
BOUNCES, ALL = 24, 60


def radiance_scene(obj, mtl, out):
    """Writes the room as a Radiance scene."""
    materials, name = {}, None
    for line in Path(mtl).read_text().splitlines():
        words = line.split()
        if words[:1] == ["newmtl"]:
            name = words[1]
            materials[name] = {"Kd": (0, 0, 0), "Ke": (0, 0, 0)}
        elif words and words[0] in ("Kd", "Ke"):
            materials[name][words[0]] = tuple(map(float, words[1:4]))
    text = []
    for name, own in materials.items():
        if any(own["Ke"]):
            text.append(f"void light {name}\n0\n0\n3 {own['Ke'][0]} {own['Ke'][1]} {own['Ke'][2]}\n")
        else:
            text.append(f"void plastic {name}\n0\n0\n5 {own['Kd'][0]} {own['Kd'][1]} {own['Kd'][2]} 0 0\n")
    vertices, name, count = [], None, 0
    for line in Path(obj).read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append(words[1:4])
        elif words[:1] == ["usemtl"]:
            name = words[1]
        elif words[:1] == ["f"]:
            corners = [vertices[int(w.split("/")[0]) - (1 if int(w.split("/")[0]) > 0 else 0)] for w in words[1:]]
            numbers = "\n".join(" ".join(corner) for corner in corners)
            text.append(f"{name} polygon p{count}\n0\n0\n{3 * len(corners)}\n{numbers}\n")
            count += 1
    Path(out).write_text("\n".join(text))


def without_reflection(folder):
    """A copy of the room whose lamp reflects nothing, as `light` does in Radiance; its scene file."""
    for end in ("obj", "toml"):
        shutil.copy(HOME / f"meshes/furnished-room.{end}", folder)
    text, lamp = [], False
    for line in (HOME / "meshes/furnished-room.mtl").read_text().splitlines():
        lamp = line.split()[1:] == ["lamp"] if line.startswith("newmtl") else lamp
        text.append("Kd 0 0 0" if lamp and line.startswith("Kd") else line)
    (Path(folder) / "furnished-room.mtl").write_text("\n".join(text) + "\n")
    return f"{folder}/furnished-room.toml"


def run(command, **options):
    """Runs a program; its output, and the CPU seconds of it."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, **options)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return done.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def rtrace(tool, octree, points, settings, env, bounces=BOUNCES):
    """Irradiance at points, mean of the channels; and the CPU seconds."""
    text = "\n".join(" ".join(map(str, point)) for point in points) + "\n"
    command = [tool, "-h", "-I", "-ab", str(bounces), "-lw", "1e-6", "-dt", "0", "-dc", "1", "-ds", "0.05", *settings]
    out, seconds = run([*command, octree], input=text.encode(), env=env)
    rows = [list(map(float, line.split())) for line in out.decode().splitlines() if line.strip()]
    return [sum(row[:3]) / 3 for row in rows], seconds


def halflight(program, grid, tolerance, folder, seed):
    """The points' rows, and the CPU seconds that they took."""
    common = [program, "render", without_reflection(folder), "--mode", "global", "--size", "16x16", "--out", folder,
              "--quiet", "--tolerance", str(tolerance), "--seed", str(seed)]
    _, without = run(common)
    _, both = run([*common, "--points", grid])
    with open(Path(folder) / "furnished-room-points-global.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    return rows, both - without


def error(own, reference, noise, chosen):
    """RMS of the relative differences at the chosen points, noise taken off."""
    import numpy

    off = numpy.array([own[k] for k in chosen]) / reference - 1
    return max(0.0, float(numpy.mean(off**2 - noise**2))) ** 0.5


def main():
    import numpy
    import pyradiance

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=str(HOME / "target/release/halflight"))
    parser.add_argument("--points", type=int, default=10000)
    parser.add_argument("--sample", type=int, default=150, help="points of the reference")
    parser.add_argument("--tolerances", type=float, nargs="+", default=[0.02, 0.01, 0.005])
    parser.add_argument("--settings", nargs="+", default=SETTINGS, help="-aa,-ad,-as of rtrace")
    own = parser.parse_args()
    tools = Path(pyradiance.__file__).parent
    env = {**os.environ, "RAYPATH": str(tools / "lib"), "PATH": f"{tools / 'bin'}:{os.environ['PATH']}"}
    tool = str(tools / "bin" / "rtrace")
    with tempfile.TemporaryDirectory() as folder:
        scene, octree = f"{folder}/room.rad", f"{folder}/room.oct"
        radiance_scene(HOME / "meshes/furnished-room.obj", HOME / "meshes/furnished-room.mtl", scene)
        Path(octree).write_bytes(run([str(tools / "bin" / "oconv"), scene], env=env)[0])
        spacing = (5 * 4 / own.points) ** 0.5
        ran = {t: halflight(own.program, f"grid:room@0.8,{spacing}", t, folder, 1) for t in own.tolerances}
        rows = ran[own.tolerances[0]][0]
        kept = [k for k, row in enumerate(rows) if row["inside"] == "0"]
        points = [[float(row[c]) for c in ("x", "y", "z", "nx", "ny", "nz")] for row in rows]
        chosen = kept[:: max(1, len(kept) // own.sample)]
        exact = ["-aa", "0", "-ad", "4096", "-as", "0", "-u+", "-lr", f"-{ALL}"]
        halves = [rtrace(tool, octree, [points[k] for k in chosen], exact, env, ALL) for _ in range(2)]
        a, b = (numpy.array(half[0]) for half in halves)
        reference, noise = (a + b) / 2, abs(a - b) / (a + b)
        print(f"{len(rows)} points, {len(kept)} of them outside of solids; reference at {len(chosen)}: rtrace -aa 0, "
              f"{halves[0][1] + halves[1][1]:.0f} CPU s, "
              f"its noise {100 * float(numpy.mean(noise**2)) ** 0.5:.2f} %")
        print(f"{'':<34}{'CPU s':>8}{'true':>9}{'mean':>9}{'stated':>9}")
        for tolerance, (rows, seconds) in ran.items():
            value = lambda row, what: sum(float(row[f"{what}_{c}"]) for c in "rgb") / 3
            found = [value(row, "irradiance") for row in rows]
            bias = float(numpy.mean(numpy.array([found[k] for k in chosen]) / reference)) - 1
            stated = numpy.mean([(value(rows[k], "error") / found[k]) ** 2 for k in chosen]) ** 0.5
            print(f"{f'halflight, {100 * tolerance:g} %':<34}{seconds:>8.1f}"
                  f"{100 * error(found, reference, noise, chosen):>8.2f} %{100 * bias:>7.2f} %{100 * stated:>7.2f} %")
        for setting in own.settings:
            accuracy, divisions, samples = setting.split(",")
            settings = ["-aa", accuracy, "-ad", divisions, "-as", samples, "-ar", "256", "-lr", f"-{BOUNCES}"]
            # Without interpolation every point takes as long as any other.
            asked = chosen if float(accuracy) == 0 else range(len(points))
            found, seconds = rtrace(tool, octree, [points[k] for k in asked], settings, env)
            found, seconds = dict(zip(asked, found)), seconds * len(points) / len(asked)
            bias = float(numpy.mean(numpy.array([found[k] for k in chosen]) / reference)) - 1
            print(f"{f'rtrace -aa {accuracy} -ad {divisions} -as {samples}':<34}{seconds:>8.1f}"
                  f"{100 * error(found, reference, noise, chosen):>8.2f} %{100 * bias:>7.2f} %", flush=True)


if __name__ == "__main__":
    main()
