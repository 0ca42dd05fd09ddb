#!/usr/bin/env python3
"""Daylight coefficients beside Radiance: skies, coefficients, products and seconds, of an office.

    python benches/daylight.py skies                  patch radiances of a year beside gendaymtx
    python benches/daylight.py office                 D of an office beside rfluxmtx, and what dctimestep makes of it

Radiance comes from `pip install pyradiance`; without it, and numpy, nothing is measured and the exit code is 0. The
office is 6 by 8 by 3 m with reflectances 0.2, 0.5 and 0.7, a window with a frame in the south, and 100 points at 0.8 m.
"""

import argparse
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

try:
    import numpy as np
    import pyradiance
except ImportError as missing:
    print(f"nothing is measured: {missing}")
    sys.exit(0)

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = os.environ.get("HALFLIGHT_PROGRAM", str(ROOT / "target/release/halflight"))
RADIANCE = pathlib.Path(pyradiance.__file__).parent
ENVIRONMENT = {**os.environ, "RAYPATH": f".:{RADIANCE / 'lib'}", "PATH": f"{RADIANCE / 'bin'}:{os.environ['PATH']}"}
RHO = {"floor": 0.2, "walls": 0.5, "ceiling": 0.7, "frame": 0.5}


def run(arguments, folder, **more):
    """Standard output of a program as bytes."""
    return subprocess.run(
        [str(a) for a in arguments], cwd=folder, env=ENVIRONMENT, check=True, stdout=subprocess.PIPE, **more
    ).stdout


# The office: quadrilaterals by material, seen from inside counter-clockwise, z up, the window at y = 0.


def quad(a, b, c, d, towards):
    """Corners such that the front faces `towards`."""
    corners = [np.array(p, float) for p in (a, b, c, d)]
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    return corners if normal @ np.array(towards, float) > 0 else corners[::-1]


def box(low, high):
    """The six sides of a box, seen from outside."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    return [
        quad((x0, y0, z0), (x0, y1, z0), (x0, y1, z1), (x0, y0, z1), (-1, 0, 0)),
        quad((x1, y0, z0), (x1, y1, z0), (x1, y1, z1), (x1, y0, z1), (1, 0, 0)),
        quad((x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1), (0, -1, 0)),
        quad((x0, y1, z0), (x1, y1, z0), (x1, y1, z1), (x0, y1, z1), (0, 1, 0)),
        quad((x0, y0, z0), (x1, y0, z0), (x1, y1, z0), (x0, y1, z0), (0, 0, -1)),
        quad((x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1), (0, 0, 1)),
    ]


def office():
    """Quadrilaterals by material."""
    w, d, h, t = 6.0, 8.0, 3.0, 0.2
    x0, x1, z0, z1 = 0.5, 5.5, 0.9, 2.7
    shapes = {
        "floor": [quad((0, 0, 0), (w, 0, 0), (w, d, 0), (0, d, 0), (0, 0, 1))],
        "ceiling": [quad((0, 0, h), (w, 0, h), (w, d, h), (0, d, h), (0, 0, -1))],
        "walls": [
            quad((0, 0, 0), (0, d, 0), (0, d, h), (0, 0, h), (1, 0, 0)),
            quad((w, 0, 0), (w, d, 0), (w, d, h), (w, 0, h), (-1, 0, 0)),
            quad((0, d, 0), (w, d, 0), (w, d, h), (0, d, h), (0, -1, 0)),
        ],
        "frame": [],
    }
    for y, towards in ((0.0, (0, 1, 0)), (-t, (0, -1, 0))):
        for a, b, c, e in ((0, w, 0, z0), (0, w, z1, h), (0, x0, z0, z1), (x1, w, z0, z1)):
            shapes["walls"].append(quad((a, y, c), (b, y, c), (b, y, e), (a, y, e), towards))
    shapes["walls"] += [
        quad((x0, -t, z0), (x1, -t, z0), (x1, 0, z0), (x0, 0, z0), (0, 0, 1)),
        quad((x0, -t, z1), (x1, -t, z1), (x1, 0, z1), (x0, 0, z1), (0, 0, -1)),
        quad((x0, -t, z0), (x0, 0, z0), (x0, 0, z1), (x0, -t, z1), (1, 0, 0)),
        quad((x1, -t, z0), (x1, 0, z0), (x1, 0, z1), (x1, -t, z1), (-1, 0, 0)),
    ]
    for x in (2.1, 3.8):
        shapes["frame"] += box((x, -0.14, z0), (x + 0.08, -0.06, z1))
    return shapes


def points():
    """100 points at 0.8 m, 10 by 10."""
    return [(0.3 + 0.6 * i, 0.4 + 0.8 * j, 0.8) for j in range(10) for i in range(10)]


def write_office(folder):
    """The office as an OBJ and as Radiance's scene, and its points for both."""
    shapes = office()
    lines, count = ["mtllib office.mtl"], 0
    for name, quads in shapes.items():
        lines += [f"o {name}", f"usemtl {name}"]
        for corners in quads:
            lines += ["v " + " ".join(f"{x:.6f}" for x in corner) for corner in corners]
            lines.append("f " + " ".join(str(count + k) for k in (1, 2, 3, 4)))
            count += 4
    (folder / "office.obj").write_text("\n".join(lines) + "\n")
    mtl = [f"newmtl {name}\nKd {rho} {rho} {rho}\n" for name, rho in RHO.items()]
    (folder / "office.mtl").write_text("".join(mtl))
    rad = [f"void plastic {name}\n0\n0\n5 {rho} {rho} {rho} 0 0\n" for name, rho in RHO.items()]
    for name, quads in shapes.items():
        for k, corners in enumerate(quads):
            numbers = "\n".join(" ".join(f"{x:.6f}" for x in corner) for corner in corners)
            rad.append(f"{name} polygon {name}.{k}\n0\n0\n12\n{numbers}\n")
    (folder / "office.rad").write_text("\n".join(rad))
    rows = [f"{x} {y} {z} 0 0 1" for x, y, z in points()]
    (folder / "office.pts").write_text("\n".join(rows) + "\n")
    (folder / "sky.rad").write_text(
        "#@rfluxmtx h=u u=Y\nvoid glow ground_glow\n0\n0\n4 1 1 1 0\n\nground_glow source ground\n0\n0\n4 0 0 -1 180\n\n"
        "#@rfluxmtx h=r1 u=Y\nvoid glow sky_glow\n0\n0\n4 1 1 1 0\n\nsky_glow source sky\n0\n0\n4 0 0 1 180\n"
    )


def ours(folder, tolerance, seed, more=()):
    """D, its errors, and the seconds of the program."""
    start = time.perf_counter()
    run(
        [PROGRAM, "daylight", "office.obj", "--points", "office.pts", "--up", "z", "--tolerance", tolerance, "--seed"]
        + [seed, "--out", f"h{tolerance}-{seed}", "--quiet", *more],
        folder,
    )
    seconds = time.perf_counter() - start
    arrays = np.load(folder / f"h{tolerance}-{seed}/office-daylight.npz")
    return arrays["D"][:, :, 0], arrays["error"][:, :, 0], seconds


def rfluxmtx(folder, name, samples, bounces=8, seed=0):
    """D by Radiance, and its seconds: the samples of a point are averages of `samples` paths."""
    start = time.perf_counter()
    options = ["-I", "-n", os.cpu_count(), "-ab", bounces, "-ad", samples, "-lw", 0.1 / samples, "-y", len(points())]
    with open(folder / "office.pts", "rb") as given:
        bytes_ = run(["rfluxmtx", "-faf", *options, "-u+", "-", "sky.rad", "office.rad"], folder, stdin=given)
    seconds = time.perf_counter() - start
    (folder / f"{name}.mtx").write_bytes(bytes_)
    return read_matrix(bytes_)[:, :, 0], seconds


def read_matrix(content):
    """Rows × columns × components."""
    head, body = content.split(b"\n\n", 1)
    keys = dict(line.split("=", 1) for line in head.decode(errors="replace").splitlines() if "=" in line)
    shape = [int(keys[k]) for k in ("NROWS", "NCOLS", "NCOMP")]
    if keys["FORMAT"].strip() == "ascii":
        return np.array(body.split(), float).reshape(shape)
    return np.frombuffer(body, {"float": "<f4", "double": "<f8"}[keys["FORMAT"].strip()]).reshape(shape).astype(float)


def weather(folder):
    """A year of hours: clear, cloudy and overcast in turn, by day and by night."""
    rows = ["place Test_XXX", "latitude 47.5", "longitude -8.5", "time_zone -15", "site_elevation 430"]
    rows.append("weather_data_file_units 1")
    random = np.random.default_rng(1)
    lengths = [31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31]
    for month, length in enumerate(lengths, 1):
        for day in range(1, length + 1):
            clear = random.uniform()
            for hour in range(24):
                height = max(0.0, np.sin(np.pi * (hour + 0.5 - 5) / 14)) if 5 <= hour < 19 else 0.0
                direct, diffuse = 950 * height * max(0.0, clear - 0.3), 40 * (height > 0) + 300 * height * (1 - clear)
                rows.append(f"{month} {day} {hour + 0.5:.3f} {direct:.0f} {diffuse:.0f}")
    (folder / "year.wea").write_text("\n".join(rows) + "\n")


def skies(folder):
    """Patch radiances of a year beside gendaymtx."""
    write_office(folder)
    weather(folder)
    for mf in (1, 2, 4):
        command, start = ["gendaymtx", "-od", "-m", mf, "-c", 1, 1, 1], time.perf_counter()
        theirs = read_matrix(run([*command, "year.wea"], folder, stderr=subprocess.DEVNULL))[:, :, 0]
        seconds = time.perf_counter() - start
        run(
            [PROGRAM, "daylight", "office.obj", "--points", "one.csv", "--up", "z", "--mf", mf, "--bounces", 0]
            + ["--sky", "year.wea", "--out", "s", "--quiet"],
            folder,
        ) if (folder / "one.csv").write_text("3,4,0.8,0,0,1\n") else None
        own = read_matrix((folder / "s/office-daylight-sky.mtx").read_bytes())[:, :, 0]
        lit = theirs > 0
        apart = np.abs(own - theirs)[lit] / theirs[lit]
        print(f"MF:{mf}  {theirs.shape[0]} columns, {theirs.shape[1]} hours (gendaymtx {seconds:.1f} s):", end=" ")
        print(f"largest relative difference {apart.max():.1e}, where they are dark {np.abs(own[~lit]).max():.1e}")


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def wrong(found, truth):
    """RMS over points of each point's RMS error over its RMS coefficient."""
    return rms(np.sqrt(np.sum((found - truth) ** 2, 1) / np.sum(truth**2, 1)))


def compare(folder, samples, repeats, tolerances):
    """D beside rfluxmtx, column by column; products beside dctimestep; seconds at equal true error."""
    write_office(folder)
    weather(folder)
    long = [rfluxmtx(folder, f"long{k}", samples) for k in range(repeats)]
    truth = np.mean([own for own, _ in long], 0)
    # Paths that end in a patch are counted: variances go as coefficients do, with one factor for all of them.
    spread = np.var([own for own, _ in long], 0, ddof=1)
    noise = np.sqrt(spread.sum() / truth.sum() * truth / repeats)
    theirs, seconds = wrong(truth + noise * np.sqrt(repeats), truth), statistics.median(s for _, s in long)
    print(f"rfluxmtx -ad {samples}, {repeats} times: {seconds:.1f} s each, standard error {100 * theirs:.2f} % each,", end=" ")
    print(f"{100 * wrong(truth + noise, truth):.2f} % of the mean", flush=True)
    for tolerance in tolerances:
        for seed in range(3):
            found, error, own = ours(folder, tolerance, seed)
            both = np.hypot(error, noise)
            columns = np.sqrt(np.mean((found - truth) ** 2, 0) / np.maximum(np.mean(both**2, 0), 1e-30))[truth.sum(0) > 0]
            share = np.abs(found - truth)[truth > 0] / both[truth > 0]
            stated, apart = wrong(found + error, found), wrong(found, truth)
            true = np.sqrt(max(apart**2 - wrong(truth + noise, truth) ** 2, (0.3 * apart) ** 2))
            equal = seconds * (theirs / true) ** 2
            print(
                f"halflight {tolerance} seed {seed}: {own:.2f} s, stated {100 * stated:.2f} %, apart {100 * apart:.2f} %, "
                f"true {100 * true:.2f} %; apart over both errors by column: median {np.median(columns):.2f}, most "
                f"{columns.max():.2f}; within twice both {100 * np.mean(share < 2):.1f} %; rfluxmtx takes {equal:.0f} s to "
                f"that error, {equal / own:.0f} times as long",
                flush=True,
            )
    for count in (1000, 4000):
        found, own = rfluxmtx(folder, f"short{count}", count)
        print(f"rfluxmtx -ad {count}: {own:.1f} s, apart {100 * wrong(found, truth):.2f} %", flush=True)
    product(folder, tolerances[-1])


def product(folder, tolerance):
    """What dctimestep makes of our matrices beside our own illuminances."""
    ours(folder, tolerance, 0, ["--sky", "year.wea"])
    out = folder / f"h{tolerance}-0"
    start = time.perf_counter()
    theirs = read_matrix(
        run(["dctimestep", "-of", out / "office-daylight.mtx", out / "office-daylight-sky.mtx"], folder)
    )
    seconds = time.perf_counter() - start
    arrays, sky = np.load(out / "office-daylight.npz"), read_matrix((out / "office-daylight-sky.mtx").read_bytes())
    own = arrays["D"][:, :, 0] @ sky[:, :, 0]
    lit = own > 1e-6 * own.max()
    print(f"dctimestep reads D and the skies ({seconds:.1f} s): {theirs.shape[0]} x {theirs.shape[1]} products,", end=" ")
    print(f"largest relative difference to ours {np.max(np.abs(theirs[:, :, 0] - own)[lit] / own[lit]):.1e}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["skies", "office"])
    parser.add_argument("--samples", type=int, default=20000, help="-ad of rfluxmtx as a reference")
    parser.add_argument("--repeats", type=int, default=4, help="references of which the mean is taken")
    parser.add_argument("--tolerances", type=float, nargs="+", default=[0.05, 0.02])
    parser.add_argument("--folder", help="keep the files there")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as own:
        folder = pathlib.Path(given.folder or own).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        if given.what == "skies":
            skies(folder)
        else:
            compare(folder, given.samples, given.repeats, given.tolerances)


if __name__ == "__main__":
    main()
