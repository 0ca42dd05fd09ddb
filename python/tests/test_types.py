"""Types and words: stubs are what is generated, mypy is content with them, help says shapes, units and errors."""

from __future__ import annotations

import ast
import inspect
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import halflight as hl

PYTHON = Path(__file__).resolve().parents[1]
EXAMPLES = """
import numpy as np
import halflight as hl

scene = hl.cornell_box()
picture = hl.render(scene, mode="global", size=(8, 8), tolerance=0.5)
total: float = picture.error.total
total = hl.render(scene).error.total
effort = hl.render(scene, patches=100, samples=8)
total = effort.error.total  # error
axes = picture.plot()
axes.set_title("box")
again = hl.solve(scene, keep=2).picture(hl.Camera([0, 0, 0], [0, 0, 1]))
codes = picture.srgb(exposure="auto")
solution: hl.Solution = hl.solve(scene, alpha=1, tau=0.3, patches=100, rays=16)
power: float = float(solution.bounces[2].power[0])
lamps: hl.Lamps = hl.solve(scene, per="luminaire", patches=100, rays=16)
mixed = lamps.mix({"light": 0.5})
found = solution.operator.matvec(np.zeros(solution.operator.shape[0]))
lower, upper = solution.radius
factors: hl.Factors = hl.factors(scene, tolerance=0.1)
light: hl.Irradiance = solution.points([[100, 50, 100]], [0, 1, 0], tolerance=0.5)
light.mix(light.dim(500))
K: hl.Operator = solution.operator
room = hl.Scene.from_objects({"room": hl.box([0, 0, 0], [1, 1, 1])}, lights=[hl.SunLight([0, -1, 0], 1)])
relit = hl.relight("report.json", {"light": 0.5}).factors["light"].sum()
hl.render(scene, mode="gobal")  # error
hl.solve(scene, patches="many")  # error
"""


def mypy(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    pytest.importorskip("mypy")
    config = PYTHON / "pyproject.toml"
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file", str(config), *map(str, arguments)]
    return subprocess.run(command, cwd=PYTHON, capture_output=True, text=True)


def test_the_package_is_typed() -> None:
    done = mypy(PYTHON / "halflight")
    assert done.returncode == 0, done.stdout
    assert (Path(hl.__file__).parent / "py.typed").exists()


def test_examples_are_checked_by_their_types(tmp_path: Path) -> None:
    script = tmp_path / "example.py"
    script.write_text(EXAMPLES)
    done = mypy(script)
    wrong = [k for k, line in enumerate(EXAMPLES.splitlines(), 1) if line.endswith("# error")]
    found = [int(line.split(":")[1]) for line in done.stdout.splitlines() if ": error:" in line]
    # An overloaded function is told by its name's line, once for each of its two forms at most.
    assert sorted(set(found)) == wrong, done.stdout


@pytest.mark.parametrize("notebook", sorted((PYTHON / "notebooks").glob("*.ipynb")), ids=lambda path: path.stem)
def test_notebooks_as_scripts_are_typed(notebook: Path, tmp_path: Path) -> None:
    nbformat = pytest.importorskip("nbformat")
    cells = nbformat.read(notebook, 4).cells
    code = "\n\n".join(cell.source for cell in cells if cell.cell_type == "code")
    script = tmp_path / "notebook.py"
    script.write_text("\n".join(line for line in code.splitlines() if not line.startswith("%")))
    done = mypy(script)
    assert done.returncode == 0, done.stdout


def test_stubs_are_what_is_generated(tmp_path: Path) -> None:
    maturin = shutil.which("maturin")
    if maturin is None or shutil.which("cargo") is None:
        pytest.skip("maturin or cargo is missing")
    command = [maturin, "generate-stubs", "--profile", "release", "--out", str(tmp_path)]
    done = subprocess.run(command, cwd=PYTHON, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (made,) = tmp_path.rglob("_native.pyi")
    assert made.read_text() == (PYTHON / "halflight" / "_native.pyi").read_text(), (
        "the native module has changed: maturin generate-stubs --profile release --out DIR, then copy _native.pyi"
    )


FUNCTIONS = [
    "render",
    "trace",
    "solve",
    "bounces",
    "points",
    "factors",
    "patch_factors",
    "stability_map",
    "load",
    "open",
    "relight",
    "explore",
    "box",
    "quad",
    "srgb",
    "exposure",
]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_help_says_shapes_units_and_errors(name: str) -> None:
    words = inspect.getdoc(getattr(hl, name)) or ""
    assert "Parameters\n----------" in words and "Returns\n-------" in words
    assert any(part in words for part in ("Raises\n------", "Warns\n-----"))
    for parameter in inspect.signature(getattr(hl, name)).parameters:
        assert parameter in words, parameter


def test_the_words_of_render() -> None:
    words = inspect.getdoc(hl.render) or ""
    assert "(height, width, 3) float32" in words and "W/(m² sr)" in words and "Diverges" in words and "GiB" in words


def test_everything_public_has_words() -> None:
    for name in hl.__all__:
        found = getattr(hl, name)
        if name.startswith("__"):
            continue
        assert inspect.getdoc(found), name
        if inspect.isclass(found):
            for own, member in vars(found).items():
                if not own.startswith("_") and (inspect.isfunction(member) or isinstance(member, property)):
                    assert inspect.getdoc(member), f"{name}.{own}"


def test_what_stands_in_init_is_all() -> None:
    tree = ast.parse((Path(hl.__file__)).read_text())
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module != "typing"]
    imported = {alias.asname or alias.name for node in imports for alias in node.names}
    # `from halflight import *` leaves the built-in function alone.
    assert imported == {*hl.__all__, "open"}


def test_examples_in_the_words_run() -> None:
    import doctest
    import importlib

    modules = (
        "_scene",
        "_meshes",
        "_materials",
        "_images",
        "_render",
        "_solve",
        "_operator",
        "_factors",
        "_points",
        "_relight",
    )
    for module in modules:
        result = doctest.testmod(importlib.import_module(f"halflight.{module}"))
        assert result.failed == 0 and result.attempted > 0, module
