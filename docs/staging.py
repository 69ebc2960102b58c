"""The sources of the site, assembled: pages of this folder, pages kept beside the code, generated pages.

A page stays where developers look for it, and links to others as files of the repository, so that it
can also be read there. Here every page gets its place on the site, and the links are adapted.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parent

# Pages whose place on the site differs from that in the repository, by the latter.
PLACES = {
    "CONTRIBUTING.md": "contribute/index.md",
    "CHANGELOG.md": "changes.md",
    "algorithms/deadwood_algorithms/paper/README.md": "explanation/twins.md",
    "benchmarks/README.md": "explanation/benchmarks.md",
    "benchmarks/population.md": "explanation/population.md",
    "benchmarks/promise.md": "explanation/promise.md",
    "benchmarks/vector_files.md": "explanation/vector-files.md",
    "deadwood_toolbox/qgis_plugin/README.md": "start/first-run-qgis.md",
    "docs/add-a-tool.md": "contribute/add-a-tool.md",
    "docs/architecture.md": "contribute/architecture.md",
    "docs/change-the-physics.md": "contribute/change-the-physics.md",
    "docs/indices.md": "explanation/indices.md",
    "docs/many-machines.md": "how-to/many-machines.md",
    "docs/memory.md": "explanation/memory.md",
    "docs/paper.md": "explanation/paper.md",
    "docs/python.md": "reference/python.md",
    "docs/rare.md": "explanation/rare.md",
    "docs/real-slope.md": "tutorials/real-slope.md",
    "docs/region.md": "how-to/region.md",
    "docs/tests.md": "contribute/tests.md",
    "docs/tschamut.md": "explanation/tschamut.md",
    "engine/README.md": "explanation/physics.md",
    "sample_data/README.md": "reference/sample-data.md",
}
# Targets of links to these files and folders, which the site replaces by its own pages.
INSTEAD = {
    "README.md": "index.md",
    "algorithms/README.md": "reference/tools/index.md",
    "algorithms/deadwood_algorithms/schemas": "reference/layers/index.md",
    "docs/glossary.csv": "reference/glossary.md",
    "algorithms/deadwood_algorithms/params/events.py": "reference/events.md",
}
TOOL = re.compile(r"algorithms/deadwood_algorithms/tools/(\w+)\.py")  # which the page of the tool replaces
# Menus of pages that have none in the repository.
MENUS = {"contribute/index.md": ("architecture", "add-a-tool", "change-the-physics", "tests")}
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^()\s]+)\)")
FENCE = re.compile(r"^(```|~~~|:::).*?^\1[ \t]*$", re.MULTILINE | re.DOTALL)
# Parts of a block of commands that only Bash and similar shells understand.
ONLY_BASH = re.compile(r"<<|\$\(|^(?:export|source|cat|cp|for|rio) ", re.MULTILINE)


def pages() -> dict[str, str]:
    """Place on the site of every written page, by its place in the repository."""
    own = (path for ending in ("md", "ipynb") for path in HERE.rglob(f"*.{ending}"))
    names = (path.relative_to(HERE) for path in own)
    found = {f"docs/{name.as_posix()}": name.as_posix() for name in names if name.parts[0] != "_build"}
    return {source: place for source, place in (found | PLACES).items() if source not in INSTEAD}


def stage(folder: Path) -> None:
    """Write all sources of the site into a folder, which is emptied first."""
    from docs import generated

    shutil.rmtree(folder, ignore_errors=True)
    places = pages()
    for source, place in places.items():
        text = (ROOT / source).read_text(encoding="utf-8")
        if place.endswith(".ipynb"):
            text = staged_notebook(text, source, place, places, folder)
        else:
            text = staged_page(text, source, place, places, folder)
        if place in MENUS:
            text += "\n" + generated.toctree(MENUS[place]) + "\n"
        _write(folder / place, text)
    for place, text in generated.pages().items():
        _write(folder / place, text)
    shutil.copytree(HERE / "_static", folder / "_static")


def staged_page(text: str, source: str, place: str, places: dict[str, str], folder: Path) -> str:
    """A page of the repository prepared for the site: adapted links, copied pictures, commands for two shells."""
    text = outside_code(text, lambda part: LINK.sub(lambda m: _link(m, source, place, places, folder), part))
    text = text.replace("```mermaid", "```text")
    return FENCE.sub(lambda found: two_shells(found[0]), text)


def staged_notebook(text: str, source: str, place: str, places: dict[str, str], folder: Path) -> str:
    """A notebook with the links in its text changed like those of a page."""
    notebook = json.loads(text)
    for cell in notebook["cells"]:
        if cell["cell_type"] == "markdown":
            cell["source"] = staged_page("".join(cell["source"]), source, place, places, folder)
    return json.dumps(notebook)


def outside_code(text: str, change: Callable[[str], str]) -> str:
    """The text with the parts outside fenced blocks changed."""
    parts, last = [], 0
    for found in FENCE.finditer(text):
        if found[1] == ":::":
            continue
        parts += [change(text[last : found.start()]), found[0]]
        last = found.end()
    return "".join([*parts, change(text[last:])])


def two_shells(block: str) -> str:
    """A block of ``sh`` as tabs for Bash and PowerShell, if its lines differ there."""
    if not block.startswith("```sh\n") or "\\\n" not in block or ONLY_BASH.search(block):
        return block
    power = block.replace("```sh\n", "```powershell\n").replace(" \\\n", " `\n")
    shells = {"Linux, macOS": block, "Windows (PowerShell)": power}
    tabs = [f":::{{tab-item}} {name}\n:sync: {name}\n\n{code}\n:::" for name, code in shells.items()]
    return "\n".join(["::::{tab-set}\n:sync-group: shell\n", *tabs, "::::"])


def _link(found: re.Match[str], source: str, place: str, places: dict[str, str], folder: Path) -> str:
    picture, text, target = found.groups()
    path, _, anchor = target.partition("#")
    if target.startswith(("https://", "mailto:")) or not path:
        return found[0]
    meant = os.path.normpath(os.path.join(os.path.dirname(source), path)).replace(os.sep, "/")
    if picture or meant.endswith((".png", ".webp", ".svg", ".gif")):
        kept = f"pictures/{meant.replace('/', '-')}"
        (folder / kept).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / meant, folder / kept)
        return f"{picture}[{text}]({_relative(kept, place)})"
    if tool := TOOL.fullmatch(meant):
        name = tool[1].replace("_", "-")
        return f"[{text}]({_relative(f'reference/tools/{name}.md', place)})"
    if target_place := (places | INSTEAD).get(meant):
        return f"[{text}]({_relative(target_place, place)}{'#' + anchor if anchor else ''})"
    if not (ROOT / meant).exists():
        raise SystemExit(f"{source}: a link to {target}, which does not exist")
    return text  # a file of the repository that is not a page: its name is enough


def _relative(target: str, place: str) -> str:
    return os.path.relpath(target, os.path.dirname(place) or ".").replace(os.sep, "/")


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
