"""Who may import whom: three layers, dependencies downward only; checked in the syntax trees."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
ENGINE = ROOT / "engine" / "deadwood_engine"
ALGORITHMS = ROOT / "algorithms" / "deadwood_algorithms"
TOOLBOX = ROOT / "deadwood_toolbox"
HEAVY = {"geopandas", "pandas", "rasterio", "pyogrio", "pyproj", "pyarrow", "matplotlib", "numba", "deadwood_engine"}
PUBLIC = {"run", "Ask", "TOOL"}  # of a tool, for another tool
# A tool computes on arrays and passes tables on; files are opened by layers.py and its siblings.
TOOL_LIBRARIES = {"numpy", "shapely", "geopandas", "pandas", "deadwood_algorithms", "deadwood_engine"}
# The packages, from the bottom up: each may use those before it. The subjects of a package (its folders) never use one
# another, only the modules of the package itself.
ROOMS = (
    "params", "schemas", "intake", "files", "stats", "scene", "simulate", "results", "ensemble",
    "prepare", "evaluate", "report", "explore", "paper", "tools",
)  # fmt: skip


def imported(source: str, package: str) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Every import in a source, wherever it stands: full module name, and the names taken from it."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, ()
        elif isinstance(node, ast.ImportFrom):
            base = package if node.level == 1 else ""
            assert node.level <= 1, "no import from above the package"
            yield ".".join(part for part in (base, node.module) if part), tuple(alias.name for alias in node.names)


def foreign(source: str, package: str, allowed: set[str]) -> set[str]:
    """The imported top-level names that are neither allowed nor in the standard library."""
    roots = {module.split(".")[0] for module, _ in imported(source, package)}
    return roots - allowed - sys.stdlib_module_names - {"__future__"}


def tool_breaches(source: str, tools: set[str]) -> list[str]:
    """What a tool's file imports against the project's rules; ``tools``: the names of the other tools' modules."""
    breaches = sorted(foreign(source, "deadwood_algorithms", TOOL_LIBRARIES))
    whole = set()  # other tools imported as modules
    for module, names in imported(source, "deadwood_algorithms.tools"):
        if module.startswith("deadwood_engine."):
            breaches.append(f"{module}: only the engine's public names")
        if module == "deadwood_algorithms.tools":
            whole |= tools & set(names)
        if module.removeprefix("deadwood_algorithms.tools.") in tools and not set(names) <= PUBLIC:
            breaches.append(f"{module}: another tool only through its run")
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Attribute) or not isinstance(node.value, ast.Name):
            continue
        if node.value.id in whole and node.attr not in PUBLIC:
            breaches.append(f"{node.value.id}.{node.attr}: another tool only through its run")
    return breaches


def place_of(module: str) -> tuple[str, str]:
    """The package of a module of the algorithms, and its subfolder ("" for what is in the package itself)."""
    parts = module.split(".")[1:]
    nested = len(parts) > 1 and (ALGORITHMS / parts[0] / parts[1]).is_dir()
    return parts[0] if parts else "", parts[1] if nested else ""


def room_breaches(source: str, place: tuple[str, str]) -> list[str]:
    """What a file of a package and subject imports from packages above its own or from other subjects."""
    room, subject = place
    below = ROOMS[: ROOMS.index(room)]
    modules = set()
    for module, names in imported(source, "deadwood_algorithms"):
        if module == "deadwood_algorithms" or module.removeprefix("deadwood_algorithms.") in ROOMS:
            modules |= {f"{module}.{name}" for name in names}
        elif module.startswith("deadwood_algorithms."):
            modules.add(module)
    breaches = []
    for module in sorted(modules):
        where, about = place_of(module)
        same = where == room and about in ("", subject)
        if not same and where not in below:
            breaches.append(module)
    return breaches


def modules_imported(path: Path, modules: set[str]) -> set[str]:
    """The project's modules that a file imports, wherever the import is; those for types alone count."""
    package = ".".join(path.relative_to(ALGORITHMS.parent).parent.parts)
    found = set()
    for module, names in imported(path.read_text(encoding="utf-8"), package):
        found |= {f"{module}.{name}" if f"{module}.{name}" in modules else module for name in names or ("",)}
    return found & modules


def circles(imports: dict[str, set[str]]) -> list[list[str]]:
    """The groups of modules that import one another in a circle."""
    reached: dict[str, set[str]] = {}
    for module in imports:
        seen, left = set(), list(imports[module])
        while left:
            each = left.pop()
            if each not in seen:
                seen.add(each)
                left += imports[each]
        reached[module] = seen
    groups = {frozenset(b for b in reached[a] if a in reached[b]) for a in imports if a in reached[a]}
    return sorted(sorted(group) for group in groups)


def is_tool(path: Path) -> bool:
    return any(line.startswith("TOOL = ") for line in path.read_text(encoding="utf-8").splitlines())


TOOL_FILES = sorted(path for path in (ALGORITHMS / "tools").glob("*.py") if is_tool(path))


Breach = Callable[[Path, str], object]


def offenders(paths: Iterable[Path], breach: Breach) -> dict[str, object]:
    """What ``breach(path, source)`` finds in each file, of those in which it finds anything."""
    found = {path.relative_to(ROOT).as_posix(): breach(path, path.read_text(encoding="utf-8")) for path in paths}
    assert found, "no file was looked at"
    return {name: wrong for name, wrong in found.items() if wrong}


def files_of(*folders: Path) -> list[Path]:
    return sorted(path for folder in folders for path in folder.rglob("*.py"))


def test_the_page_of_the_architecture_names_every_package_and_folder():
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    told = dict(re.findall(r"^\| `(\w+)` \| (.*) \|$", page, re.MULTILINE))
    assert [name for name in told if name in ROOMS] == list(ROOMS)
    for room in ("prepare", "evaluate"):
        folders = {each.parent.name for each in (ALGORITHMS / room).glob("*/__init__.py")}
        assert set(re.findall(r"`(\w+)`", told[room])) == folders, room


def test_the_engine_knows_numpy_and_numba_only():
    allowed = {"numpy", "numba", "deadwood_engine"}
    assert offenders(files_of(ENGINE), lambda _, source: foreign(source, "deadwood_engine", allowed)) == {}


def test_the_vocabulary_needs_the_standard_library_only():
    paths = files_of(ALGORITHMS / "params", ALGORITHMS / "schemas")
    assert offenders(paths, lambda _, source: foreign(source, "", {"deadwood_algorithms"})) == {}


def test_algorithms_know_nothing_of_the_front_door():
    def breach(_: Path, source: str) -> set[str]:
        modules = {module.split(".")[0] for module, _ in imported(source, "deadwood_algorithms")}
        return modules & {"deadwood_toolbox", "click", "tqdm"}

    assert offenders(files_of(ALGORITHMS), breach) == {}


def test_no_modules_import_one_another_in_a_circle():
    folder = ALGORITHMS.parent
    paths = {".".join(path.relative_to(folder).with_suffix("").parts): path for path in ALGORITHMS.rglob("*.py")}
    imports = {name: modules_imported(path, set(paths)) for name, path in paths.items()}
    assert sum(map(len, imports.values())) > 500
    assert circles(imports) == []


def test_rooms_are_built_on_those_below_them():
    def breach(path: Path, source: str) -> object:
        place = place_of(".".join(("deadwood_algorithms", *path.relative_to(ALGORITHMS).with_suffix("").parts)))
        return room_breaches(source, place) if place[0] in ROOMS[:-1] else "neither a tool nor in a room"

    assert offenders((path for path in files_of(ALGORITHMS) if path not in TOOL_FILES), breach) == {}


def test_a_tool_keeps_to_its_floor():
    names = {path.stem for path in TOOL_FILES}
    assert offenders(TOOL_FILES, lambda path, source: tool_breaches(source, names - {path.stem})) == {}


def test_the_front_door_never_reaches_past_the_tools():
    allowed = {"click", "tqdm", "deadwood_algorithms", "deadwood_toolbox"}
    # For translations.py, which no command imports; and the types of what Python callers pass and get.
    types = {"geopandas", "pandas", "matplotlib"}
    more = {"translations.py": {"babel"}, "calls.py": types, "result.py": types, "sample.py": {"pandas"}}
    paths = [path for path in files_of(TOOLBOX) if TOOLBOX / "qgis_plugin" not in path.parents]

    def breach(path: Path, source: str) -> set[str]:
        return foreign(source, "deadwood_toolbox", allowed | more.get(path.name, set()))

    assert offenders(paths, breach) == {}


def test_the_plugin_needs_qgis_and_the_standard_library_only():
    """QGIS 3.22 has Python 3.9 and brings osgeo; plugins.qgis.org refuses subprocess, and QGIS 4 has another PyQt."""

    def breach(_: Path, source: str) -> set[str]:
        ast.parse(source, feature_version=(3, 9))
        roots = {module.split(".")[0] for module, _ in imported(source, "plugin")}
        own = {"qgis", "processing", "osgeo", "plugin"}  # processing is QGIS's own plugin
        return foreign(source, "plugin", own) | roots & {"subprocess", "PyQt5", "PyQt6"}

    assert offenders(files_of(TOOLBOX / "qgis_plugin"), breach) == {}


def test_the_checks_above_find_what_they_look_for():
    assert foreign("def f():\n    from rasterio.warp import x\n    import numpy, os", "p", {"numpy"}) == {"rasterio"}
    assert foreign("from .near import x", "deadwood_engine", {"deadwood_engine"}) == set()
    assert tool_breaches("from deadwood_engine.step import x", set())
    assert tool_breaches("import rasterio", set()) == ["rasterio"]
    assert tool_breaches("from deadwood_algorithms.tools.other import run", {"other"}) == []
    assert tool_breaches("from .other import helper", {"other"})
    assert tool_breaches("from deadwood_algorithms.tools import other\nother.TOOL(x=1)", {"other"}) == []
    assert tool_breaches("from deadwood_algorithms.tools import other\nother.helper()", {"other"})
    assert len(TOOL_FILES) >= 1
    assert place_of("deadwood_algorithms.evaluate.hazard.rates") == ("evaluate", "hazard")
    assert place_of("deadwood_algorithms.scene.layers") == ("scene", "")
    folder, tool = "deadwood_algorithms.results.run_folder", "deadwood_algorithms.tools.slide_logs"
    assert room_breaches(f"from {folder} import x", ("scene", "")) == [folder]
    assert room_breaches("from deadwood_algorithms.tools import slide_logs", ("results", "")) == [tool]
    assert room_breaches("from deadwood_algorithms.evaluate.hazard.rates import x", ("evaluate", "protection"))
    assert room_breaches("def f():\n    from deadwood_algorithms.params import tool\n", ("stats", "")) == []
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"a", "d"}}) == [["b", "c"], ["d"]]
    assert circles({"a": {"b"}, "b": set()}) == []


def test_the_shelf_brings_no_heavy_library_along(checkout):
    look = "import sys, deadwood_toolbox.cli, deadwood_toolbox.shelf as shelf; shelf.TOOLS; print(*sys.modules)"
    ran = subprocess.run([sys.executable, "-c", look], env=checkout, capture_output=True, text=True, check=True)
    assert HEAVY & set(ran.stdout.split()) == set()


def test_the_help_of_a_tool_imports_no_other(checkout):
    look = (
        "import sys, deadwood_toolbox.cli as cli; cli.run(['make-log', '--help']); print(*sys.modules, file=sys.stderr)"
    )
    ran = subprocess.run([sys.executable, "-c", look], env=checkout, capture_output=True, text=True, check=True)
    assert "Usage: deadwood-tool make-log" in ran.stdout
    loaded = {each.rpartition(".")[2] for each in ran.stderr.split() if each.startswith("deadwood_algorithms.tools.")}
    assert loaded & {path.stem for path in TOOL_FILES} == {"make_log"}
