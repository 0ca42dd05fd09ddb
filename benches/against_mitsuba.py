#!/usr/bin/env python3
"""Times halflight against Mitsuba 3's path tracer on one scene, at equal error, in one run.

Needs, and installs none of it: Python 3.11, `mitsuba` 3.5 or later and `numpy` (both from PyPI), a libLLVM that Dr.Jit
finds (Debian: libllvm19; elsewhere set DRJIT_LIBLLVM_PATH to the library), and a release build of halflight.

    cargo build --release
    python3 benches/against_mitsuba.py --reference DIR                        # a reference that is there
    python3 benches/against_mitsuba.py --scene meshes/two-rooms.toml --make-reference DIR --seconds 600
    python3 benches/against_mitsuba.py --reference DIR                        # the one just made

A reference directory holds a scene file (.toml with its .obj and .mtl) and reference.exr, reference_se.exr (standard
error) and mask.exr (1 where a pixel sees no luminaire): linear radiance, 32-bit floats, box filter.

Both programs render the same polygons, camera and size with all cores. Polygons are cut into triangles here, concave ones
too, because Mitsuba's own OBJ reader fans them. Surfaces are one-sided and diffuse with Kd and Ke from the MTL.
Mitsuba: `path`, unlimited depth, multijitter, variant llvm_ad_rgb; its time is that of the render call alone, after a
first call of the same kind that compiles the kernels; reading the scene and building its tree are not counted.
halflight: `seconds.total` of its report, reading the scene included. Times are medians over the rounds, in each of which
both programs take their turn.

Error: sqrt( max(0, mean((I-R)^2) - mean(se^2)) / mean(R^2) ) over the mask's pixels and the channels. Mitsuba's time to
the error that halflight reached is read from its measured sample counts: between two of them along the straight line in
log-log, beyond the last as N^-1/2, which is said with the factor.
"""

import argparse
import json
import math
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

NEEDS = "needs `pip install mitsuba numpy` and a libLLVM (Debian: apt install libllvm19; else set DRJIT_LIBLLVM_PATH)"
BLOCK_PATHS = 1 << 24  # paths of one render call at most: some 3 GB
TOLERANCES = (0.05, 0.02, 0.01, 0.005)
HOME = Path(__file__).resolve().parent.parent


# --- the scene -------------------------------------------------------------------------------------------------------


def read_scene(path):
    """Camera, materials {name: (Kd, Ke)} and triangles {name: [(corner, corner, corner)]} of a scene file."""
    with open(path, "rb") as file:
        scene = tomllib.load(file)
    unknown = set(scene) - {"obj", "camera", "mode"}
    if unknown or scene.get("mode", "global") != "global":
        sys.exit(f"{path}: {', '.join(unknown) or 'its mode'} has no counterpart in Mitsuba's path tracer")
    materials, triangles = read_obj(Path(path).parent / scene["obj"])
    return scene["camera"], materials, triangles


def read_obj(path):
    vertices, materials, triangles, name = [], {}, {}, None
    for line in joined_lines(path):
        word, _, rest = line.partition(" ")
        if word == "v":
            vertices.append(tuple(float(x) for x in rest.split()[:3]))
        elif word == "mtllib":
            materials |= read_mtl(path.parent / rest.strip())
        elif word == "usemtl":
            name = rest.strip()
        elif word == "f":
            numbers = [int(corner.split("/")[0]) for corner in rest.split()]
            corners = [vertices[n - 1 if n > 0 else n] for n in numbers]
            triangles.setdefault(name, []).extend(cut(corners))
    return materials, triangles


def read_mtl(path):
    materials, name = {}, None
    for line in joined_lines(path):
        word, _, rest = line.partition(" ")
        if word == "newmtl":
            name = rest.strip()
            materials[name] = ([0.0] * 3, [0.0] * 3)
        elif word in ("Kd", "Ke"):
            numbers = [float(x) for x in rest.split()]
            materials[name][word == "Ke"][:] = numbers * 3 if len(numbers) == 1 else numbers
    return materials


def joined_lines(path):
    text = path.read_text().replace("\\\n", " ")
    lines = (line.split("#")[0].strip().replace("\t", " ") for line in text.splitlines())
    return [line for line in lines if line]


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cut(corners):
    """A planar polygon as triangles of the same orientation, by clipping ears."""
    normal = (0.0, 0.0, 0.0)
    for a, b in zip(corners, corners[1:] + corners[:1]):
        normal = tuple(n + c for n, c in zip(normal, cross(a, b)))
    turn = lambda a, b, c: dot(cross(sub(b, a), sub(c, a)), normal)
    left, triangles = list(corners), []
    while len(left) > 3:
        for k in range(len(left)):
            a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
            others = [p for p in left if p not in (a, b, c)]
            inside = any(min(turn(a, b, p), turn(b, c, p), turn(c, a, p)) >= 0 for p in others)
            if turn(a, b, c) > 0 and not inside:
                triangles.append((a, b, c))
                del left[k]
                break
        else:  # only collinear corners are left: they bound no area
            left = []
    triangles += [tuple(left)] if left else []
    if abs(sum(turn(*t) for t in triangles) - dot(normal, normal)) > 1e-6 * dot(normal, normal):
        sys.exit(f"a polygon cannot be cut into triangles: {corners}")
    return triangles


# --- Mitsuba ---------------------------------------------------------------------------------------------------------


def start_mitsuba(threads):
    try:
        import mitsuba

        mitsuba.set_variant("llvm_ad_rgb")
        import drjit

        drjit.eval(drjit.arange(mitsuba.Float, 4) + 1)
    except Exception as error:
        sys.exit(f"Mitsuba does not start: {error}\nThis script {NEEDS}.")
    if threads:
        drjit.set_thread_count(threads)
    return mitsuba, drjit


def mitsuba_scene(mi, path, size, depth=-1):
    camera, materials, triangles = read_scene(path)
    to_world = mi.ScalarTransform4f().look_at(camera["position"], camera["target"], camera["up"])
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": depth},
        "sensor": {
            "type": "perspective",
            "fov": camera["vertical_fov"],
            "fov_axis": "y",
            "to_world": to_world,
            "sampler": {"type": "multijitter"},
            "film": {
                "type": "hdrfilm",
                "width": size[0],
                "height": size[1],
                "pixel_format": "rgb",
                "component_format": "float32",
                "rfilter": {"type": "box"},
            },
        },
    }
    with tempfile.TemporaryDirectory() as folder:
        for number, (name, faces) in enumerate(triangles.items()):
            reflected, emitted = materials[name]
            file = Path(folder) / f"{number}.ply"
            write_ply(file, faces)
            mesh = {"type": "ply", "filename": str(file), "face_normals": True}
            mesh["bsdf"] = {"type": "diffuse", "reflectance": {"type": "rgb", "value": reflected}}
            if any(emitted):
                mesh["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": emitted}}
            scene[f"mesh{number}"] = mesh
        return mi.load_dict(scene)


def write_ply(path, faces):
    lines = ["ply", "format ascii 1.0", f"element vertex {3 * len(faces)}"]
    lines += [f"property float {axis}" for axis in "xyz"]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(map(repr, corner)) for face in faces for corner in face]
    lines += [f"3 {3 * k} {3 * k + 1} {3 * k + 2}" for k in range(len(faces))]
    path.write_text("\n".join(lines) + "\n")


class Mitsuba:
    """Renders one scene block by block; every block has a seed of its own."""

    def __init__(self, args, scene_path, size):
        self.mi, self.dr = start_mitsuba(args.threads)
        self.scene = mitsuba_scene(self.mi, scene_path, size)
        self.size = size
        self.most = max(1, BLOCK_PATHS // (size[0] * size[1]))
        self.seed = args.seed
        self.warm = set()

    def block(self, count):
        """One call: the picture, and its seconds without compilation."""
        import numpy

        if count not in self.warm:
            self.warm.add(count)
            self.block(count)
        self.seed += 1
        self.dr.sync_thread()
        start = time.perf_counter()
        image = self.mi.render(self.scene, spp=count, seed=self.seed)
        self.dr.eval(image)
        self.dr.sync_thread()
        seconds = time.perf_counter() - start
        return numpy.array(image, dtype=numpy.float64), seconds

    def render(self, count):
        """The mean of as many blocks as `count` samples a pixel take."""
        blocks = math.ceil(count / self.most)
        found = [self.block(min(count, self.most)) for _ in range(blocks)]
        return sum(image for image, _ in found) / blocks, sum(seconds for _, seconds in found)

    def read(self, path):
        import numpy

        bitmap = self.mi.Bitmap(str(path)).convert(self.mi.Bitmap.PixelFormat.RGB, self.mi.Struct.Type.Float32, False)
        return numpy.array(bitmap, dtype=numpy.float64)

    def write(self, path, picture):
        self.mi.Bitmap(picture.astype("float32")).write(str(path))


# --- errors ----------------------------------------------------------------------------------------------------------


class Reference:
    def __init__(self, mitsuba, folder):
        read = lambda name: mitsuba.read(Path(folder) / name)
        self.mask = read("mask.exr")[..., 0] >= 0.5
        self.picture, noise = read("reference.exr")[self.mask], read("reference_se.exr")[self.mask]
        self.noise = (noise**2).sum(axis=1)
        self.power = (self.picture**2).sum(axis=1).mean()

    def error(self, picture):
        """Relative RMS error, and its upper end, two standard errors of the mean over the pixels away."""
        excess = ((picture[self.mask] - self.picture) ** 2).sum(axis=1) - self.noise
        mean, spread = excess.mean(), excess.std() / math.sqrt(len(excess))
        relative = lambda square: math.sqrt(max(0.0, square) / self.power)
        return relative(mean), relative(mean + 2 * spread)

    def own(self):
        return math.sqrt(self.noise.mean() / self.power)


def make_reference(args, scene_path):
    """Blocks of 64 samples with independent seeds until the time is over; their spread gives the standard error."""
    import numpy

    folder = args.make_reference
    folder.mkdir(parents=True, exist_ok=True)
    mitsuba = Mitsuba(args, scene_path, (args.size, args.size))
    emission = mitsuba_scene(mitsuba.mi, scene_path, mitsuba.size, depth=1)
    seen = sum(numpy.array(mitsuba.mi.render(emission, spp=256, seed=k)) for k in range(4))
    total = squares = 0.0
    blocks, start = 0, time.perf_counter()
    while blocks < 8 or time.perf_counter() - start < args.seconds:
        image, _ = mitsuba.block(64)
        total, squares, blocks = total + image, squares + image**2, blocks + 1
    mean = total / blocks
    variance = numpy.maximum(0, squares / blocks - mean**2) / (blocks - 1)
    unseen = (seen.sum(axis=2, keepdims=True) == 0).repeat(3, axis=2)
    mitsuba.write(folder / "reference.exr", mean)
    mitsuba.write(folder / "reference_se.exr", numpy.sqrt(variance))
    mitsuba.write(folder / "mask.exr", unseen.astype("float32"))
    copy_scene(scene_path, folder)
    own = Reference(mitsuba, folder).own()
    print(f"{folder}: {64 * blocks} paths a pixel, relative standard error {100 * own:.3f} %")


def copy_scene(path, folder):
    with open(path, "rb") as file:
        obj = path.parent / tomllib.load(file)["obj"]
    libraries = [line.split(None, 1)[1] for line in joined_lines(obj) if line.startswith("mtllib ")]
    for source in [path, obj, *(obj.parent / name for name in libraries)]:
        if source.resolve().parent != folder.resolve():
            shutil.copy(source, folder)


# --- the comparison --------------------------------------------------------------------------------------------------


def run_halflight(args, scene_path, size, tolerance, mitsuba, reference):
    """Seconds and error of one run of the program."""
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "picture.exr"
        command = [args.halflight, "render", scene_path, "--mode", "global", "--json", "--quiet", "-o", picture]
        command += ["--size", f"{size[0]}x{size[1]}", "--tolerance", str(tolerance)]
        command += ["--threads", str(args.threads)] if args.threads else []
        ran = subprocess.run([str(word) for word in command], capture_output=True, text=True)
        if ran.returncode != 0:
            sys.exit(f"{args.halflight} ended with code {ran.returncode}:\n{ran.stderr}")
        [report] = json.loads(ran.stdout)["modes"]
        error, upper = reference.error(mitsuba.read(picture))
        return {"seconds": report["seconds"]["total"], "error": error, "upper": upper, "parts": report["seconds"]}


def time_to(error, measured):
    """Seconds that Mitsuba takes to an error, and by which factor in samples that is beyond what was measured."""
    points = sorted((m["error"], m["seconds"]) for m in measured)  # the most exact first
    if error < points[0][0]:
        factor = (points[0][0] / error) ** 2
        return factor * points[0][1], factor
    for (e0, t0), (e1, t1) in zip(points, points[1:]):
        if error <= e1:
            share = math.log(error / e0) / math.log(e1 / e0)
            return t0 * (t1 / t0) ** share, 1.0
    factor = (points[-1][0] / error) ** 2
    return factor * points[-1][1], factor


def compare(args, scene_path):
    mitsuba = Mitsuba(args, scene_path, (1, 1))
    height, width = mitsuba.read(args.reference / "reference.exr").shape[:2]
    mitsuba = Mitsuba(args, scene_path, (width, height))
    reference = Reference(mitsuba, args.reference)
    traced = {count: [] for count in args.counts}
    rendered = {tolerance: [] for tolerance in args.tolerances}
    for _ in range(args.rounds):
        for count in args.counts:
            picture, seconds = mitsuba.render(count)
            traced[count].append({"seconds": seconds, "error": reference.error(picture)[0]})
        for tolerance in args.tolerances:
            found = run_halflight(args, scene_path, (width, height), tolerance, mitsuba, reference)
            rendered[tolerance].append(found)
    middle = lambda runs, name: statistics.median(run[name] for run in runs)
    measured = [
        {"samples": count, "seconds": middle(runs, "seconds"), "error": middle(runs, "error")}
        for count, runs in traced.items()
    ]
    print(f"{scene_path}, {width}x{height}; the reference's own standard error {100 * reference.own():.3f} %")
    print(f"\nMitsuba {mitsuba.mi.__version__}, path, multijitter, {mitsuba.dr.thread_count()} threads")
    print("  paths a pixel   seconds     error")
    for m in measured:
        print(f"  {m['samples']:13} {m['seconds']:9.3f} {100 * m['error']:8.3f} %")
    print("\nhalflight, and Mitsuba's time to the error that it reached")
    print("  tolerance   reached   seconds   Mitsuba s     ratio")
    rows = []
    for tolerance, runs in rendered.items():
        error, seconds = middle(runs, "error"), middle(runs, "seconds")
        below = error == 0.0
        error = error if not below else middle(runs, "upper")
        needed, factor = time_to(error, measured)
        note = "measured" if factor == 1.0 else f"extrapolated as N^-1/2, {factor:.2g} times the samples"
        note += ", error below what the reference can tell: its upper end" if below else ""
        print(
            f"  {100 * tolerance:7.2f} % {100 * error:7.3f} % {seconds:9.3f} {needed:11.2f} {needed / seconds:9.1f}   {note}"
        )
        row = {"tolerance": tolerance, "error": error, "seconds": seconds, "mitsuba_seconds": needed}
        rows.append(row | {"ratio": needed / seconds, "samples_factor": factor, "runs": runs})
    if args.json:
        report = {"scene": str(scene_path), "size": [width, height], "mitsuba": measured, "halflight": rows}
        args.json.write_text(json.dumps(report, indent=2) + "\n")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--reference", type=Path, metavar="DIR", help="directory of the reference to measure against")
    parser.add_argument("--make-reference", type=Path, metavar="DIR", help="make a reference there with Mitsuba, and stop")
    parser.add_argument("--scene", type=Path, help="scene file [default: the one in the reference's directory]")
    parser.add_argument("--seconds", type=float, default=600, help="time for --make-reference [default: 600]")
    parser.add_argument("--size", type=int, default=256, help="side of --make-reference, pixels [default: 256]")
    parser.add_argument("--tolerances", type=float, nargs="+", default=TOLERANCES, help="[default: 0.05 0.02 0.01 0.005]")
    parser.add_argument("--counts", type=int, nargs="+", default=[16, 64, 256], help="Mitsuba's paths a pixel [default: 16 64 256]")
    parser.add_argument("--rounds", type=int, default=3, help="times everything is measured [default: 3]")
    parser.add_argument("--threads", type=int, default=0, help="threads of both programs [default: all cores]")
    parser.add_argument("--seed", type=int, default=1, help="first of Mitsuba's seeds [default: 1]")
    parser.add_argument("--halflight", type=Path, default=HOME / "target/release/halflight", help="the program")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all numbers there too")
    return parser.parse_args()


def scene_of(args):
    if args.scene:
        return args.scene
    found = sorted(args.reference.glob("*.toml")) if args.reference else []
    if len(found) != 1:
        sys.exit("name the scene file with --scene")
    return found[0]


def main():
    args = arguments()
    if args.make_reference:
        make_reference(args, scene_of(args))
    elif not args.reference:
        sys.exit("give --reference DIR, or make one with --make-reference DIR --scene FILE")
    elif not args.halflight.exists():
        sys.exit(f"{args.halflight} is not there: cargo build --release, or name the program with --halflight")
    else:
        compare(args, scene_of(args))


if __name__ == "__main__":
    main()
