"""No files of the package import each other in a circle, wherever in them the imports stand."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

PYTHON = Path(__file__).resolve().parents[1]


def imports(files: Mapping[str, str]) -> dict[str, set[str]]:
    """The files that each file imports, of texts by paths such as ``halflight/_scene.py``."""
    modules = {".".join(Path(file).with_suffix("").parts).removesuffix(".__init__"): file for file in files}

    def named(file: str) -> Iterator[str]:
        """The modules that a file imports; names that are taken from a module count as modules of it where they are."""
        for node in ast.walk(ast.parse(files[file])):
            if isinstance(node, ast.Import):
                yield from (alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                folder = Path(file).parts[: -node.level] if node.level else ()
                start = ".".join([*folder, *([node.module] if node.module else [])])
                for alias in node.names:
                    whole = f"{start}.{alias.name}"
                    yield whole if whole in modules else start

    return {file: {modules[name] for name in named(file) if name in modules} for file in files}


def circle(graph: Mapping[str, set[str]]) -> list[str] | None:
    """Files that import each other in a circle, the first of them once more at the end."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        found: list[str] = error.args[1]
        return found
    return None


def test_no_files_import_each_other_in_a_circle() -> None:
    paths = [path for path in (PYTHON / "halflight").rglob("*") if path.suffix in (".py", ".pyi")]
    graph = imports({path.relative_to(PYTHON).as_posix(): path.read_text(encoding="utf-8") for path in paths})
    assert {"halflight/_scene.py", "halflight/_native.pyi"} <= graph["halflight/_solution.py"]
    assert circle(graph) is None


@pytest.mark.parametrize(
    "back",
    [
        "from made._a import A",
        "from made import _a",
        "from made import _a as other",
        "import made._a",
        "from ._a import A",
        "from . import _a",
        "def f():\n    from made import _a",
        "class B:\n    def f(self):\n        import made._a",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from made._a import A",
    ],
)
def test_a_circle_of_a_made_up_pair_is_found(back: str) -> None:
    pair = {"made/__init__.py": "from made._a import A", "made/_a.py": "from made._b import B"}
    assert circle(imports({**pair, "made/_b.py": "import numpy\nfrom other import _a"})) is None
    assert set(circle(imports({**pair, "made/_b.py": back})) or []) == {"made/_a.py", "made/_b.py"}


@pytest.mark.parametrize("back", ["from made import A", "import made", "from . import A"])
def test_what_imports_the_whole_package_is_in_a_circle(back: str) -> None:
    files = {"made/__init__.py": "from made._a import A", "made/_a.py": f"def f():\n    {back}"}
    assert set(circle(imports(files)) or []) == set(files)
