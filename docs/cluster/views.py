"""Many cameras of one scene at once: Dask's workers render a picture for each line of a table, to a stated error.

    python docs/cluster/views.py SCENE VIEWS.csv --out views                              # a worker on each core here
    python docs/cluster/views.py SCENE VIEWS.csv --out views --scheduler tcp://head:8786  # the workers of a scheduler

VIEWS.csv has a camera in each line, in the scene's units, and names its columns in the first:

    name,x,y,z,target_x,target_y,target_z,vertical_fov

and up_x,up_y,up_z where it is not +y that is up. Each becomes OUT/NAME.exr once it is whole, and is not rendered again
where that is. What stdout says is in the order of the table. Neither it nor the bytes of the pictures depend on the
workers. Where a camera fails the others are made, and the exit code is 1.

Every camera is solved for by itself, since how fine patches have to be follows from what it sees. A worker needs
halflight of the same version and no files, since scene and pictures travel; and RAYON_NUM_THREADS says how many cores
it has, of which Dask is to know nothing:

    RAYON_NUM_THREADS=4 dask worker tcp://head:8786 --nthreads 1 --memory-limit 0
"""

from __future__ import annotations

import argparse
import csv
import importlib.util
import os
import pickle
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import halflight as hl


def cameras(table: Path) -> dict[str, hl.Camera]:
    """The cameras of a table by their names."""
    found: dict[str, hl.Camera] = {}
    with table.open(newline="", encoding="utf-8-sig") as lines:
        for row in csv.DictReader(lines, skipinitialspace=True):
            name = row["name"]
            if name in found or not name or Path(name).name != name:
                raise ValueError(f"{name!r} is to be the name of a file, and of one camera only")
            position, target = ([float(row[own + axis]) for axis in "xyz"] for own in ("", "target_"))
            up = [float(row.get(f"up_{axis}") or default) for axis, default in zip("xyz", (0, 1, 0))]
            found[name] = hl.Camera(position, target, up, float(row["vertical_fov"]))
    return found


def view(scene: hl.Scene, camera: hl.Camera, settings: dict[str, Any]) -> bytes:
    """What a worker does. Dask by itself would send a picture as an array, without its errors."""
    return pickle.dumps(hl.render(scene.with_camera(camera), **settings))


def rendered(
    scene: hl.Scene, found: dict[str, hl.Camera], settings: dict[str, Any], scheduler: str | None, workers: int
) -> Iterator[tuple[str, hl.Picture | Exception]]:
    """The pictures of all cameras as they come, or why there is none."""
    if not found:
        return
    distributed: Any = importlib.import_module("distributed")
    with ExitStack() as held:
        place = scheduler
        if place is None:
            # One thread in each process, and no limit by Dask: halflight itself refuses what does not fit.
            place = distributed.LocalCluster(
                n_workers=min(workers, len(found)),
                threads_per_worker=1,
                memory_limit=0,
                dashboard_address=None,
                env={"RAYON_NUM_THREADS": "1"},
            )
            held.enter_context(place)
        client = held.enter_context(distributed.Client(place))
        client.wait_for_workers(1)
        everywhere = client.scatter(scene, broadcast=True)
        names = {client.submit(view, everywhere, camera, settings, pure=False): name for name, camera in found.items()}
        for done in distributed.as_completed(names):
            try:
                yield names[done], pickle.loads(done.result())
            except Exception as error:
                yield names[done], error
            done.release()


def main() -> int:
    parser = argparse.ArgumentParser(description="Renders many cameras of one scene at once.")
    parser.add_argument("scene", help="a file, or the name of a built-in scene")
    parser.add_argument("views", type=Path, help="a table: name,x,y,z,target_x,target_y,target_z,vertical_fov")
    parser.add_argument("--out", type=Path, default=Path("views"), help="folder of the pictures (%(default)s)")
    parser.add_argument("--size", default="512x512", help="width and height in pixels (%(default)s)")
    parser.add_argument("--tolerance", type=float, default=0.01, help="relative error of each picture (%(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="chooses the rays (%(default)s)")
    parser.add_argument("--memory", type=float, help="GiB that each picture may take (four fifths of what is free)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask scheduler that has workers")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes here, without a scheduler")
    own = parser.parse_args()
    if importlib.util.find_spec("distributed") is None:
        parser.error("Dask is not installed: pip install distributed")

    start = time.perf_counter()
    scene, found = hl.load(own.scene), cameras(own.views)
    width, height = (int(pixels) for pixels in own.size.split("x"))
    settings = {"size": (width, height), "tolerance": own.tolerance, "seed": own.seed, "memory": own.memory}
    own.out.mkdir(parents=True, exist_ok=True)
    file = {name: own.out / f"{name}.exr" for name in found}
    said = {name: f"{file[name]} is there" for name in found}
    missing = {name: camera for name, camera in found.items() if not file[name].exists()}
    failed = []
    for name, picture in rendered(scene, missing, settings, own.scheduler, own.workers):
        if isinstance(picture, Exception):
            failed.append(name)
            said[name] = f"{name} failed: {picture}"
            continue
        picture.save(file[name])
        error = picture.relative_error or 0.0
        said[name] = f"{file[name]}: estimated error {100 * error:.2f} %"
        if error > own.tolerance:
            said[name] += ", more than asked"
    for name in found:
        print(said[name], file=sys.stderr if name in failed else sys.stdout)
    seconds = time.perf_counter() - start
    print(f"{len(missing) - len(failed)} rendered, {len(failed)} failed in {seconds:.1f} s", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
