"""Many scenes or cameras at once, by docs/cluster: a job array's tasks without Slurm, and Dask's workers."""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import halflight as hl

ROOT = Path(__file__).resolve().parents[2]
CLUSTER = ROOT / "docs" / "cluster"

Program = Callable[..., None]
Done = subprocess.CompletedProcess[str]


def stamps(folder: Path) -> dict[str, int]:
    """When each file below a folder was written."""
    return {str(file.relative_to(folder)): file.stat().st_mtime_ns for file in folder.rglob("*") if file.is_file()}


# The job array.

LIST = """\
# Each line is a job.
render cornell-box --mode global --size 24x24 --tolerance 0.1 --seed 3 -o out/box.exr

render nothing.obj -o out/nothing.exr
render 'from above.toml' --mode local --size 16x16 --tolerance 0.1 -o out/from\\ above.exr
bounces cornell-box --mode global --count 2 --patches 100 --size 8x8 --out "out/bounces of box"
render cornell-box --mode local --size 16x16
render cornell-box -o 'out/unclosed.exr
render cornell-box --mode local --size 16x16 --tolerance 0.1 '--output=out/$(touch expanded).exr'"""
CAMERA = """\
obj = "cornell-box.obj"
[camera]
position = [278, 500, -700]
target = [278, 150, 280]
vertical_fov = 39.3
"""


@pytest.fixture
def tasks(program: Program, tmp_path: Path) -> Callable[[str], Done]:
    """Runs a line of shell in a folder with a list, where `task N` is the task of line N; needs the program."""
    bash = shutil.which("bash")
    if bash is None or shutil.which("xargs") is None:
        pytest.skip("bash or xargs is missing")
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    found = os.environ.get("HALFLIGHT_PROGRAM") or str(target / "release" / "halflight")
    (tmp_path / "a list.txt").write_text(LIST)
    (tmp_path / "from above.toml").write_text(CAMERA)
    for file in ("cornell-box.obj", "cornell-box.mtl"):
        shutil.copy(ROOT / "meshes" / file, tmp_path)
    environment = {**os.environ, "HALFLIGHT": found, "SLURM_CPUS_PER_TASK": "1", "ARRAY": str(CLUSTER / "array.sbatch")}
    environment.pop("SLURM_ARRAY_TASK_ID", None)

    def run(line: str) -> Done:
        task = 'task() { SLURM_ARRAY_TASK_ID="$1" bash "$ARRAY" "a list.txt"; }; '
        return subprocess.run([bash, "-c", task + line], cwd=tmp_path, env=environment, capture_output=True, text=True)

    return run


ALL_AT_ONCE = 'seq "$(grep -c "" "a list.txt")" | xargs -P 2 -I N env SLURM_ARRAY_TASK_ID=N bash "$ARRAY" "a list.txt"'


def test_an_array_makes_what_single_runs_make(tasks: Callable[[str], Done], program: Program, tmp_path: Path) -> None:
    done = tasks(ALL_AT_ONCE)
    # A line failed, which xargs tells by 123; the others are as if there were no such line.
    assert done.returncode == 123, done.stderr
    assert "line 4 failed with exit code 3: halflight render nothing.obj" in done.stderr
    assert "line 7 names nothing that it writes" in done.stderr and "line 8: a quote is not closed" in done.stderr
    out, alone = tmp_path / "out", tmp_path / "alone"
    made = stamps(out)
    pictures = ["box.exr", "from above.exr", "$(touch expanded).exr"]
    reports = [f"{picture}.json" for picture in pictures] + ["bounces of box/report.json"]
    assert {*pictures, *reports} <= set(made) and not any("nothing" in file or ".part" in file for file in made)
    assert not (tmp_path / "expanded").exists()
    assert json.loads((out / "box.exr.json").read_text())["modes"][0]["error"]["total"] <= 0.1

    alone.mkdir()
    program(alone, "render cornell-box --mode global --size 24x24 --tolerance 0.1 --seed 3 -o box.exr")
    program(alone, "bounces cornell-box --mode global --count 2 --patches 100 --size 8x8")
    assert (out / "box.exr").read_bytes() == (alone / "box.exr").read_bytes()
    tables = [folder / "cornell-box-bounces.csv" for folder in (out / "bounces of box", alone)]
    assert tables[0].read_bytes() == tables[1].read_bytes()

    again = tasks(ALL_AT_ONCE)
    assert again.returncode == 123 and stamps(out) == made
    assert "line 2 is finished: out/box.exr.json" in again.stdout
    # What is deleted is made once more, with the same bytes.
    (out / "box.exr").rename(out / "first.exr")
    (out / "box.exr.json").unlink()
    assert tasks("task 2").returncode == 0
    assert (out / "box.exr").read_bytes() == (out / "first.exr").read_bytes()


@pytest.mark.parametrize(
    "line, code, words",
    [
        ("task 1", 0, ""),
        ("task 3", 0, ""),
        ("task 4", 3, "line 4 failed with exit code 3"),
        ("task 7", 2, "line 7 names nothing"),
        ("task 10", 2, "a list.txt has no line 10"),
        ("task ''", 2, "SLURM_ARRAY_TASK_ID"),
        ('SLURM_ARRAY_TASK_ID=1 bash "$ARRAY" missing.txt', 2, "give a list"),
        ("HALFLIGHT=./missing task 2", 127, "line 2 failed with exit code 127"),
    ],
)
def test_a_task_says_by_its_exit_code_what_came_of_it(
    tasks: Callable[[str], Done], tmp_path: Path, line: str, code: int, words: str
) -> None:
    done = tasks(line)
    assert done.returncode == code and words in done.stderr and done.stdout == "", done.stderr
    assert not [*tmp_path.rglob("*.exr"), *tmp_path.rglob("*.json"), *tmp_path.rglob("*.part")]


# Dask's workers.

CAMERAS = {
    "front": ([278, 273, -800], [278, 273, 0], 39.3),
    "nowhere": ([1, 2, 3], [1, 2, 3], 40),
    "left side": ([100, 273, -700], [278, 200, 280], 39.3),
    "inside": ([500, 300, 20], [150, 150, 500], 70),
}


def views(folder: Path, *options: str) -> Done:
    with (folder / "views.csv").open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["name", "x", "y", "z", "target_x", "target_y", "target_z", "vertical_fov"])
        table.writerows([name, *position, *target, fov] for name, (position, target, fov) in CAMERAS.items())
    command = [sys.executable, str(CLUSTER / "views.py"), "cornell-box", "views.csv", "--size", "24x16"]
    command += ["--tolerance", "0.1", "--out", "views", *options]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120)


def test_workers_make_what_one_process_makes(box: hl.Scene, tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="Dask is not installed: pip install distributed")
    out, alone = tmp_path / "views", tmp_path / "alone.exr"
    done = views(tmp_path, "--workers", "2")
    assert done.returncode == 1 and "nowhere failed: the camera's position is its target" in done.stderr, done.stderr
    names = [name for name in CAMERAS if name != "nowhere"]
    # In the order of the table, whichever worker was ready first.
    assert [line.split(":")[0] for line in done.stdout.splitlines()] == [str(Path("views", f"{n}.exr")) for n in names]
    assert set(stamps(out)) == {f"{name}.exr" for name in names}
    for name in names:
        position, target, fov = CAMERAS[name]
        camera = hl.Camera(position, target, vertical_fov=fov)
        hl.render(box.with_camera(camera), size=(24, 16), tolerance=0.1).save(alone)
        assert (out / f"{name}.exr").read_bytes() == alone.read_bytes(), name

    made, said = stamps(out), done.stdout
    (out / "front.exr").unlink()
    again = views(tmp_path, "--workers", "1")
    assert again.returncode == 1 and "1 rendered, 1 failed" in again.stderr
    assert again.stdout.splitlines()[0] == said.splitlines()[0] and again.stdout.count("is there") == 2
    kept = {file: stamp for file, stamp in stamps(out).items() if file != "front.exr"}
    assert kept == {file: stamp for file, stamp in made.items() if file != "front.exr"}


def test_workers_that_are_there_are_used(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="Dask is not installed: pip install distributed")
    (tmp_path / "views").mkdir()
    (tmp_path / "views" / "nowhere.exr").touch()
    one = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None, "env": {"RAYON_NUM_THREADS": "1"}}
    with distributed.LocalCluster(**one) as cluster:
        done = views(tmp_path, "--scheduler", cluster.scheduler_address)
    assert done.returncode == 0 and "3 rendered, 0 failed" in done.stderr, done.stderr
    # Nothing is left to be done, so nobody is asked.
    again = views(tmp_path, "--scheduler", "tcp://127.0.0.1:1")
    assert again.returncode == 0 and again.stdout.count("is there") == len(CAMERAS), again.stderr


def test_views_say_that_dask_is_missing(tmp_path: Path) -> None:
    code = "import runpy, sys; sys.modules['distributed'] = None; sys.argv = sys.argv[1:]; "
    code += "runpy.run_path(sys.argv[0], run_name='__main__')"
    command = [sys.executable, "-c", code, str(CLUSTER / "views.py"), "cornell-box", "views.csv"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2 and "Dask is not installed: pip install distributed" in done.stderr, done.stderr
