#!/usr/bin/env python3
"""Scenes that ought to break an estimate of error, with references, as folders that `yardstick.py` takes.

    python3 benches/torture.py OUT [--program P] [--seconds 20] [--only NAME,NAME]

Needs `numpy` and `OpenEXR` (PyPI) and a release build of halflight. Each OUT/NAME gets NAME.obj, NAME.mtl, NAME.toml,
and a.exr, b.exr (the program's own path tracer, two seeds, so many seconds each) with mask.exr.

| scene | what it tries |
|---|---|
| grains | bright grains of 0.3 % of a pixel on a dark plane: what few camera rays meet |
| wires | thin bright wires before a dark wall |
| gap | a lit wall through a gap that is a small part of one row of pixels |
| holes | small holes in a dark leaf before a bright wall |
| ring | a dim green group of lamps inside a ring of red ones over a floor that reflects green |
| lamps | 256 lamps of four colours below a ceiling |
| pinhole | a lamp outside a wall with a hole of 5 cm: a spot is all the light of the room |
| slit | a sun through a slit of 2 cm |
| grating | a sun through a grating onto a floor that the camera does not see |
| sconce | a spot 6 cm from a wall behind a pillar |
| lantern | a lamp in a box with slits |
| bowl | a bowl of 200 facets under a sky: a picture that is nearly flat |
| pane | a pane of alpha = 0.1, tau = 0.9 in a room that emits everywhere |
"""

import argparse
import math
import random
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import yardstick  # noqa: E402

SIZE = "96x72"


class Scene:
    """Polygons by material, and the lines of a scene file."""

    def __init__(self, camera, more=""):
        self.materials, self.faces, self.camera, self.more = {}, [], camera, more

    def material(self, name, kd, ke=(0, 0, 0)):
        self.materials[name] = (kd, ke)
        return name

    def polygon(self, material, *corners):
        self.faces.append((material, corners))

    def box(self, material, low, high, inward=False, leave=()):
        """The six sides of a box, seen from outside or from inside; `leave` names those left out: x0, x1, y0, ..."""
        for axis in range(3):
            for end in range(2):
                if f"{'xyz'[axis]}{end}" in leave:
                    continue
                corners = []
                for p, q in ((0, 0), (1, 0), (1, 1), (0, 1)):
                    c = [0, 0, 0]
                    c[axis] = (low, high)[end][axis]
                    c[(axis + 1) % 3] = (low, high)[p][(axis + 1) % 3]
                    c[(axis + 2) % 3] = (low, high)[q][(axis + 2) % 3]
                    corners.append(tuple(c))
                self.polygon(material, *(corners if (end == 1) != inward else corners[::-1]))

    def floor(self, material, low, high, z, up=True):
        (x0, y0), (x1, y1) = low, high
        corners = [(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]
        self.polygon(material, *(corners if up else corners[::-1]))

    def wall_with_holes(self, material, x, low, high, holes):
        """A thin wall across x, two-sided by two layers, with rectangular holes [(y0, z0, y1, z1)]."""
        ys = sorted({low[0], high[0], *(h[0] for h in holes), *(h[2] for h in holes)})
        zs = sorted({low[1], high[1], *(h[1] for h in holes), *(h[3] for h in holes)})
        for y0, y1 in zip(ys, ys[1:]):
            for z0, z1 in zip(zs, zs[1:]):
                if any(h[0] <= y0 and y1 <= h[2] and h[1] <= z0 and z1 <= h[3] for h in holes):
                    continue
                corners = [(x, y0, z0), (x, y1, z0), (x, y1, z1), (x, y0, z1)]
                self.polygon(material, *corners)
                self.polygon(material, *((c[0] - 0.01, c[1], c[2]) for c in corners[::-1]))

    def write(self, folder, name):
        folder.mkdir(parents=True, exist_ok=True)
        text, count = [f"mtllib {name}.mtl"], 0
        for material, corners in self.faces:
            text += [f"usemtl {material}"] + ["v %.7g %.7g %.7g" % tuple(c) for c in corners]
            text.append("f " + " ".join(str(count + k + 1) for k in range(len(corners))))
            count += len(corners)
        (folder / f"{name}.obj").write_text("\n".join(text) + "\n")
        of = lambda three: " ".join("%.7g" % v for v in three)
        mtl = [f"newmtl {n}\nKd {of(kd)}\nKe {of(ke)}\n" for n, (kd, ke) in self.materials.items()]
        (folder / f"{name}.mtl").write_text("\n".join(mtl))
        position, target, fov = self.camera
        (folder / f"{name}.toml").write_text(
            f'obj = "{name}.obj"\n\n[camera]\nposition = {list(position)}\ntarget = {list(target)}\n'
            f"up = [0, 0, 1]\nvertical_fov = {fov}\n{self.more}"
        )


def grains():
    s = Scene(((0, 0, 6), (0, 0.001, 0), 36))
    dark, bright = s.material("dark", (0.03, 0.03, 0.03)), s.material("bright", (0.95, 0.95, 0.95))
    lamp = s.material("lamp", (0, 0, 0), (80, 80, 80))
    s.floor(dark, (-4, -4), (4, 4), 0)
    pixel, draw = 6 * 2 * math.tan(math.radians(18)) / 72, random.Random(3)
    side = pixel * math.sqrt(0.003)
    for _ in range(2000):
        x, y = draw.uniform(-2, 2), draw.uniform(-1.6, 1.6)
        s.floor(bright, (x, y), (x + side, y + side), 1e-3)
    s.floor(lamp, (3, -1), (5, 1), 6, up=False)
    return s


def wires():
    s = Scene(((0, -5, 1.5), (0, 0, 1.5), 36))
    dark, bright = s.material("dark", (0.05, 0.05, 0.05)), s.material("bright", (0.9, 0.85, 0.8))
    lamp = s.material("lamp", (0, 0, 0), (30, 30, 30))
    s.box(dark, (-4, -6, 0), (4, 4, 4), inward=True)
    for k in range(40):
        x = -2 + k * 0.1
        s.box(bright, (x, 0, 0), (x + 0.001, 0.001, 4), leave=("z0", "z1"))
    s.floor(lamp, (-1, -3), (1, -2), 3.99, up=False)
    return s


def gap():
    s = Scene(((-4, 0, 1), (0, 0, 1), 40))
    grey, lamp = s.material("grey", (0.6, 0.6, 0.6)), s.material("lamp", (0, 0, 0), (200, 190, 170))
    s.box(grey, (-5, -3, 0), (5, 3, 3), inward=True)
    s.wall_with_holes(grey, 0, (-3, 0), (3, 3), [(-3, 0.8, 3, 0.8015)])
    s.floor(lamp, (2, -1), (3, 1), 2.99, up=False)
    return s


def holes():
    s = Scene(((-3, 0, 1.5), (0, 0, 1.5), 40))
    grey, lamp = s.material("grey", (0.6, 0.6, 0.6)), s.material("lamp", (0, 0, 0), (40, 40, 40))
    dark = s.material("leaf", (0.02, 0.03, 0.02))
    s.box(grey, (-5, -3, 0), (5, 3, 3), inward=True)
    draw, cut = random.Random(5), []
    for k in range(24):
        y, z = -2 + 4 * ((k % 6) + draw.random()) / 6, 0.5 + 2 * ((k // 6) + draw.random()) / 4
        cut.append((y, z, y + 0.02, z + 0.02))
    s.wall_with_holes(dark, 0, (-3, 0), (3, 3), cut)
    s.floor(lamp, (2, -1), (4, 1), 2.99, up=False)
    return s


def ring():
    s = Scene(((3, 0.2, 2.6), (3, 3.1, 0), 36))
    floor = s.material("floor", (0.02, 0.7, 0.02))
    red, green = s.material("red", (0, 0, 0), (60, 0, 0)), s.material("green", (0, 0, 0), (0, 1.5, 0))
    s.floor(floor, (-2, -2), (8, 8), 0)
    for k in range(40):
        x, y = 3 + 0.7 * math.cos(k * math.tau / 40), 3 + 0.7 * math.sin(k * math.tau / 40)
        s.floor(red, (x, y), (x + 0.03, y + 0.03), 1.0, up=False)
    for k in range(9):
        x, y = 3.15 + 0.04 * (k % 3), 2.9 + 0.04 * (k // 3)
        s.floor(green, (x, y), (x + 0.03, y + 0.03), 1.0, up=False)
    return s


def lamps():
    s = Scene(((0.3, 0.3, 1.6), (6, 6, 0.5), 50))
    grey = s.material("grey", (0.5, 0.5, 0.5))
    colours = [s.material(f"lamp{k}", (0, 0, 0), c) for k, c in enumerate([(9, 1, 1), (1, 9, 1), (1, 1, 9), (5, 5, 5)])]
    s.box(grey, (0, 0, 0), (8, 8, 3), inward=True)
    s.box(grey, (3, 3, 0), (4, 5, 1.2), leave=("z0",))
    for k in range(256):
        x, y = 0.25 + (k % 16) * 0.5, 0.25 + (k // 16) * 0.5
        s.floor(colours[(k * 7 // 5) % 4], (x, y), (x + 0.05, y + 0.05), 2.95, up=False)
    return s


def pinhole():
    s = Scene(((3.5, 0.4, 1.6), (0.4, 2.6, 0.6), 55))
    grey, lamp = s.material("grey", (0.7, 0.7, 0.7)), s.material("lamp", (0, 0, 0), (4000, 3800, 3400))
    s.box(grey, (-2, 0, 0), (4, 3, 2.5), inward=True)
    s.wall_with_holes(grey, 0, (0, 0), (3, 2.5), [(1.4, 1.6, 1.45, 1.65)])
    s.polygon(lamp, (-1.5, 1.2, 2.0), (-1.5, 1.4, 2.0), (-1.5, 1.4, 2.2), (-1.5, 1.2, 2.2))
    return s


def sun(direction, radiance):
    return f'\n[[lights]]\ntype = "directional"\ndirection = {list(direction)}\nintensity = {list(radiance)}\n'


def slit():
    s = Scene(((3.5, 0.4, 1.6), (0.4, 2.6, 0.6), 55), sun((1, 0.2, -0.8), (300, 290, 260)))
    grey = s.material("grey", (0.7, 0.7, 0.7))
    s.box(grey, (0, 0, 0), (4, 3, 2.5), inward=True, leave=("x0",))
    s.wall_with_holes(grey, 0, (0, 0), (3, 2.5), [(0.5, 1.5, 2.5, 1.52)])
    return s


def grating():
    s = Scene(((3.6, 0.3, 2.2), (3.6, 2.6, 2.2), 60), sun((0.6, 0.1, -1), (60, 58, 50)))
    grey = s.material("grey", (0.7, 0.7, 0.7))
    s.box(grey, (0, 0, 0), (4, 3, 2.5), inward=True, leave=("x0",))
    cut = [(0.3, 1.5 + 0.06 * k, 2.7, 1.5 + 0.06 * k + 0.02) for k in range(14)]
    s.wall_with_holes(grey, 0, (0, 0), (3, 2.5), cut)
    s.box(grey, (2.4, 0, 1.2), (2.45, 3, 1.9))
    return s


def sconce():
    s = Scene(
        ((1.2, 0.3, 1.8), (3.2, 3.0, 0.6), 60),
        '\n[[lights]]\ntype = "spot"\nposition = [0.06, 2.0, 1.2]\ndirection = [-1, 0, 0]\n'
        "intensity = [3.0, 2.5, 2.0]\ncutoff = 60.0\nexponent = 2.0\n",
    )
    grey, wood = s.material("grey", (0.7, 0.7, 0.7)), s.material("wood", (0.5, 0.35, 0.2))
    s.box(grey, (0, 0, 0), (4, 4, 3), inward=True)
    s.box(wood, (0.35, 1.5, 0), (0.75, 2.5, 2.2), leave=("z0",))
    return s


def lantern():
    s = Scene(((0.5, 0.5, 1.5), (2.5, 2.5, 0.8), 60))
    grey, lamp = s.material("grey", (0.6, 0.6, 0.6)), s.material("lamp", (0, 0, 0), (900, 800, 600))
    iron = s.material("iron", (0.1, 0.1, 0.1))
    s.box(grey, (0, 0, 0), (4, 4, 2.5), inward=True)
    s.box(lamp, (2.45, 2.45, 1.0), (2.55, 2.55, 1.1))
    for k in range(16):
        a, b = (math.tau * (k + e) / 16 for e in (0.0, 0.85))
        p, q = ((2.5 + 0.2 * math.cos(t), 2.5 + 0.2 * math.sin(t)) for t in (a, b))
        corners = [(*p, 0.9), (*q, 0.9), (*q, 1.2), (*p, 1.2)]
        s.polygon(iron, *corners)
        s.polygon(iron, *((2.5 + 0.99 * (x - 2.5), 2.5 + 0.99 * (y - 2.5), z) for x, y, z in corners[::-1]))
    for z, up in ((0.9, False), (1.2, True)):
        s.floor(iron, (2.3, 2.3), (2.7, 2.7), z, up)
        s.floor(iron, (2.3, 2.3), (2.7, 2.7), z + (0.002 if not up else -0.002), not up)
    return s


def bowl():
    s = Scene(((0, -0.5, 3), (0, 0, -0.3), 36), "\n[sky]\nradiance = [1, 1, 1]\n")
    grey = s.material("grey", (0.5, 0.5, 0.5))
    at = lambda i, j: (
        math.sin(math.pi / 2 * j / 10) * math.cos(math.tau * i / 20),
        math.sin(math.pi / 2 * j / 10) * math.sin(math.tau * i / 20),
        -math.cos(math.pi / 2 * j / 10),
    )
    for j in range(10):
        for i in range(20):
            corners = [at(i, j + 1), at(i + 1, j + 1), at(i + 1, j), at(i, j)]
            s.polygon(grey, *(corners[:3] if j == 0 else corners))
    return s


def pane():
    s = Scene(((0.2, -0.9, 0), (0, 0.9, 0), 60), '\n[materials."glass"]\nalpha = 0.1\ntau = 0.9\ntwo_sided = true\n')
    glow, glass = s.material("glow", (0.5, 0.5, 0.5), (0.25, 0.25, 0.25)), s.material("glass", (0.5, 0.5, 0.5))
    s.box(glow, (-1, -1, -1), (1, 1, 1), inward=True)
    s.polygon(glass, (-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1))
    return s


SCENES = (grains, wires, gap, holes, ring, lamps, pinhole, slit, grating, sconce, lantern, bowl, pane)


def reference(program, folder, name, seconds):
    """Two estimates by path tracing; pixels where both agree exactly, and those around, see luminaires."""
    for seed, estimate in enumerate("ab"):
        command = [program, "trace", str(folder / f"{name}.toml"), "--mode", "global", "--size", SIZE, "-q"]
        command += ["--seed", str(1000 + seed), "--samples", "65536", "--time", str(seconds), "--out", str(folder)]
        subprocess.run([*command, "-o", str(folder / f"{estimate}.exr")], check=True)
    yardstick.write_mask(folder)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--program", default=str(yardstick.HOME / "target" / "release" / "halflight"))
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--only", type=lambda text: text.split(","))
    options = parser.parse_args()
    for make in SCENES:
        name = make.__name__
        if options.only and name not in options.only:
            continue
        make().write(options.out / name, name)
        reference(options.program, options.out / name, name, options.seconds)
        print(name, flush=True)


if __name__ == "__main__":
    main()
