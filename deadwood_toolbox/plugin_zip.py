"""``deadwood-tool qgis-plugin``: pack the QGIS plugin, with the declarations of every tool, into an installable zip.

For plugins.qgis.org the plugin also needs an e-mail address, its repository and its tracker. They are in
``pyproject.toml`` (``authors`` with ``email``, ``[project.urls]`` with ``Repository``, ``Issues`` and ``Homepage``) or
nowhere: missing ones are omitted from ``metadata.txt``, and the command reports what an upload would lack.
"""

from __future__ import annotations

import json
import re
import struct
import sys
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from email.utils import parseaddr
from importlib import metadata
from pathlib import Path
from typing import Any

from deadwood_algorithms.files.outputs import output_path
from deadwood_algorithms.params import tool
from deadwood_algorithms.params.tool import VERSION, Feedback, Outcome, Tool, UserError
from deadwood_toolbox import parameters
from deadwood_toolbox.feedback import plain

SOURCE = Path(__file__).parent / "qgis_plugin"
FOLDER = "deadwood"  # folder in the zip, and therefore the plugin's name in QGIS
KINDS = {".py", ".svg", ".model3"}
# Pictures of the site: beside the package in a checkout, inside the package if installed.
SITE_PICTURES = tuple(each / "docs" / "pictures" for each in (SOURCE.parents[1], SOURCE.parent))
DISTRIBUTION = "deadwood-toolbox"
# Line of metadata.txt -> name of the URL in pyproject.toml. plugins.qgis.org requires the first two and an e-mail
# address.
URLS = {"repository": "repository", "tracker": "issues", "homepage": "homepage"}
ASKED_FOR = ("email", "repository", "tracker")
MO_HEADER = "Content-Type: text/plain; charset=UTF-8\n"
DAY = (2000, 1, 1, 0, 0, 0)  # date of every file in the zip: same version, same bytes


@dataclass(frozen=True, kw_only=True)
class Ask:
    output: Path = tool.output_file("Zip to be made", ".zip")
    portable: bool = tool.flag(
        "Leave out where this toolbox is installed",
        help="For a zip that is passed on; the plugin then looks on the PATH and in the usual folders.",
    )
    wheel: Path | None = tool.file(
        "The toolbox's own wheel, to be packed with the plugin",
        default=None,
        help="The plugin then installs the toolbox from it (pip wheel --no-deps . makes one), where no package index "
        "has it.",
    )
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    with output_path(ask.output, ask.overwrite, suffix=".zip") as temporary:
        manifest = declarations() if ask.portable else {**declarations(), "packed_in": sys.prefix}
        known = contacts()
        pack(temporary, manifest, known, wheel=checked_wheel(ask.wheel))
    lines = (
        f"{ask.output}: the plugin for QGIS 3.22 to 4.x, with the tools of version {VERSION}",
        "in QGIS: Plugins > Manage and Install Plugins > Install from ZIP; then open the Processing toolbox",
    )
    missing = [name for name in ASKED_FOR if name not in known]
    if missing:
        feedback.note(f"not ready for plugins.qgis.org: pyproject.toml names no {', '.join(missing)}")
    return Outcome({"output": ask.output}, {}, lines)


def declarations() -> dict[str, Any]:
    """The output of ``describe --json`` for all tools, from which the plugin makes its dialogs even without the
    toolbox.

    It includes the texts and colours of the page of `explore`, which the panel in QGIS also uses.
    """
    from deadwood_algorithms.explore import web_page
    from deadwood_algorithms.tools.explore import FRICTION
    from deadwood_toolbox.shelf import TOOLS

    explore = {**web_page.facts(), "friction": FRICTION}
    return plain({"version": VERSION, "tools": [parameters.describe(each) for each in TOOLS], "explore": explore})


def contacts() -> dict[str, str]:
    """The authors' e-mail address and the web addresses of the package, as lines of ``metadata.txt``."""
    try:
        fields: Any = metadata.metadata(DISTRIBUTION)
    except metadata.PackageNotFoundError:  # run from a checkout that is not installed
        return {}
    urls = {}
    for each in fields.get_all("Project-URL") or []:
        label, _, url = each.partition(", ")
        urls[label.lower()] = url
    address = parseaddr((fields.get_all("Author-email") or [""])[0])[1]
    found = {"email": address, **{line: urls.get(name, "") for line, name in URLS.items()}}
    return {line: value for line, value in found.items() if value}


def licence() -> str:
    """The text of the licence, which plugins.qgis.org requires in the zip, from the checkout or the installed
    package.
    """
    beside = SOURCE.parents[1] / "LICENSE"
    if beside.is_file():
        return beside.read_text(encoding="utf-8")
    return metadata.distribution(DISTRIBUTION).read_text("licenses/LICENSE") or ""


def checked_wheel(path: Path | None) -> Path | None:
    """The wheel, verified to be the toolbox of this version, because the dialogs belong to this version."""
    wanted = f"{DISTRIBUTION.replace('-', '_')}-{VERSION}-"
    if path is not None and not (path.name.startswith(wanted) and path.suffix == ".whl" and path.is_file()):
        raise UserError(f"--wheel is {path}, but must be a file {wanted}*.whl (pip wheel --no-deps . makes it)")
    return path


def pack(path: Path, manifest: dict[str, Any], known: Mapping[str, str], *, wheel: Path | None = None) -> None:
    """Write the zip: the plugin's sources, icons and catalogues, metadata with version and contacts, the manifest.

    And, if one is given, the toolbox's wheel.
    """
    # imported here, because it loads what only the reading of results needs
    from deadwood_algorithms.report.words import read_catalogue

    files: dict[str, str | bytes] = {}
    files |= {each.relative_to(SOURCE).as_posix(): each.read_text(encoding="utf-8") for each in _sources()}
    files |= {f"pictures/{each.name}": each.read_bytes() for each in pictures()}
    for each in SOURCE.rglob("*.po"):
        messages = {english: text for (_, english), text in read_catalogue(each.read_text(encoding="utf-8")).items()}
        files[each.relative_to(SOURCE).with_suffix(".mo").as_posix()] = compiled(messages)
    about = (SOURCE / "metadata.txt").read_text(encoding="utf-8").rstrip() + "\n"
    about += "".join(f"{line}={value}\n" for line, value in known.items())
    files["metadata.txt"] = about.replace("version=VERSION", f"version={VERSION}")
    if wheel is not None:
        files[f"wheels/{wheel.name}"] = wheel.read_bytes()
    files["LICENSE"] = licence()
    files["manifest.json"] = json.dumps(manifest, indent=1, ensure_ascii=False) + "\n"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as target:
        for name, content in sorted(files.items()):
            entry = zipfile.ZipInfo(f"{FOLDER}/{name}", DAY)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            target.writestr(entry, content)


def compiled(messages: Mapping[str, str]) -> bytes:
    """A catalogue in gettext's binary form (.mo), which the standard library reads but does not write."""
    texts = sorted((key.encode(), value.encode()) for key, value in {"": MO_HEADER, **messages}.items())
    columns = [key for key, _ in texts], [value for _, value in texts]
    place = 28 + 16 * len(texts)  # position of the first text, after the header and two tables of lengths and positions
    tables, body = b"", b""
    for column in columns:
        for text in column:
            tables += struct.pack("<2I", len(text), place + len(body))
            body += text + b"\0"
    head = struct.pack("<7I", 0x950412DE, 0, len(texts), 28, 28 + 8 * len(texts), 0, place)
    return head + tables + body


def pictures() -> list[Path]:
    """The pictures of the help pages (`help_pages.PICTURES`, which only QGIS can import)."""
    wanted = set(re.findall(r'"(\w+\.webp)"', (SOURCE / "help_pages.py").read_text(encoding="utf-8")))
    folder = next((each for each in SITE_PICTURES if each.is_dir()), None)
    return [folder / name for name in sorted(wanted)] if folder else []


def _sources() -> list[Path]:
    return sorted(each for each in SOURCE.rglob("*") if each.suffix in KINDS and each.is_file())


TOOL = Tool("qgis-plugin", "About the tools", "Pack the plugin for QGIS into a zip", Ask, run, in_qgis=False)
