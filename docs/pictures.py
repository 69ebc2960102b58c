"""The pictures of the site and of the README: ``python -m docs.pictures`` makes them with the toolbox's commands.

Needs Chromium for pictures of reports. The files are committed, so the site builds without sliding a log.
Those of the plugin's page are made by ``python tests/qgis/window.py``.
"""

from __future__ import annotations

import argparse
import io
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from PIL import Image

from deadwood_toolbox import cli

HERE = Path(__file__).parent
ROOT = HERE.parent
FOLDER = HERE / "pictures"
WIDEST = 1400  # pixels
sys.path.append(str(ROOT / "tests" / "algorithms"))


def walk(page: str, folder: Path) -> None:
    """Run the commands of a tutorial in a folder with the sample data."""
    (folder / "sample_data").symlink_to(ROOT / "sample_data")
    text = (HERE / page).read_text(encoding="utf-8")
    for block in re.findall(r"^```sh\n(.*?)^```", text, re.DOTALL | re.MULTILINE):
        for line in block.replace("\\\n", " ").splitlines():
            tool(line, folder)


def tool(line: str, folder: Path) -> None:
    """Run a command line in that folder."""
    import contextlib

    print(f"$ {line}")
    with contextlib.chdir(folder):
        if cli.run([*shlex.split(line)[1:], "--quiet"]) != 0:
            raise SystemExit(f"failed: {line}")


def keep(picture: Image.Image | Path, name: str) -> None:
    """Save a picture as WebP, not wider than the page."""
    image = (Image.open(picture) if isinstance(picture, Path) else picture).convert("RGB")
    image.thumbnail((WIDEST, 4 * WIDEST), Image.Resampling.LANCZOS)
    FOLDER.mkdir(exist_ok=True)
    image.save(FOLDER / f"{name}.webp", quality=82, method=6)
    print(f"wrote {FOLDER / name}.webp, {image.width} x {image.height}")


class Page:
    """A report in a browser, of which parts are captured."""

    def __init__(self, path: Path) -> None:
        from browser import Browser  # pyright: ignore[reportMissingImports]

        self.browser = Browser()
        self.browser.size(1200, 900)
        self.browser.open(path)
        time.sleep(2.0)

    def part(self, element: str, until: str = "null") -> Image.Image:
        """The element named by a JavaScript expression, as on the screen, or up to the next named one."""
        box = self.browser.ask(
            f"(() => {{ const e = {element}; const after = {until}; e.scrollIntoView({{block: 'start'}});"
            " return new Promise((done) => requestAnimationFrame(() => setTimeout(() => {"
            " const b = e.getBoundingClientRect();"
            " done([b.left, b.top, b.right, after ? after.getBoundingClientRect().top : b.bottom]); }, 600))); })()"
        )
        whole = Image.open(io.BytesIO(self.browser.picture()))
        return whole.crop((max(0, int(box[0])), max(0, int(box[1])), round(box[2]), round(min(box[3], whole.height))))

    def moving(self, share: float) -> Image.Image:
        """The 3-D view at this share of the duration."""
        self.browser.wait("window.deadwoodView && deadwoodView.scene().last > 0")
        self.browser.ask(
            "(() => { const s = document.querySelector('[data-part=\"time\"]');"
            f" s.value = s.max * {share}; s.dispatchEvent(new Event('input')); }})()"
        )
        return self.part("document.querySelector('.space canvas')")


def of_demo(folder: Path) -> None:
    tool("deadwood-tool demo --output demo", folder)
    keep(folder / "demo" / "demo.png", "demo")


def of_sample_slope(folder: Path) -> None:
    walk("tutorials/sample-slope.md", folder)
    tool("deadwood-tool make-report with_forest --annex --output seen.html", folder)
    page = Page(folder / "seen.html")
    page.browser.size(1200, 1400)
    keep(page.moving(0.22), "view_3d")
    keep(page.part("document.querySelector('.map')"), "report_map")
    page.browser.close()
    keep(folder / "figures" / "comparison_runout.png", "runout")


def of_calibration(folder: Path) -> None:
    walk("tutorials/calibrate-an-event.md", folder)
    keep(folder / "calibration" / "calibration.png", "calibration")


def of_barrier(folder: Path) -> None:
    walk("tutorials/barrier-and-felling.md", folder)
    keep(folder / "siting" / "barriers.png", "siting")
    page = Page(folder / "effects.html")
    page.browser.size(1200, 1400)
    keep(page.part("document.querySelector('#numbers')", "document.querySelector('#judgement')"), "comparison")
    page.browser.close()
    line = (
        "deadwood-tool vary --dem sample_data/dem.tif --releases releases.gpkg --trees trees.gpkg --lines "
        "'sample_data/sample.gpkg|layername=lines' --friction 0.25 --vary "
        "friction=0.2:0.3,rolling_friction,tree_dbh_factor --fidelity draft --output varied"
    )
    tool(line, folder)
    keep(next((folder / "varied").glob("*.png")), "tornado")


def of_explore(folder: Path) -> None:
    """The page of `explore`: a release on the slope, and what a barrier below it changes."""
    from browser import Browser  # pyright: ignore[reportMissingImports]

    (folder / "sample_data").symlink_to(ROOT / "sample_data")
    tool(
        "deadwood-tool import-trees --trees sample_data/trees.csv --dem sample_data/dem.tif --output trees.gpkg", folder
    )
    line = (
        "explore --dem sample_data/dem.tif --trees trees.gpkg --lines sample_data/sample.gpkg|layername=lines "
        "--dbh-cm 50 --length-m 20 --no-browser"
    )
    command = [sys.executable, "-m", "deadwood_toolbox", *line.split()]
    here = {**os.environ, "PYTHONPATH": os.pathsep.join(each for each in sys.path if each)}
    with subprocess.Popen(command, cwd=folder, env=here, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        browser = Browser()
        browser.size(1400, 900)
        browser.open(process.stdout.readline().strip())
        browser.wait("window.deadwoodExplore?.state.scene")

        def at(x: float, y: float) -> tuple[float, float]:
            return tuple(browser.ask(f"deadwoodExplore.map.seen({x}, {y})"))

        def settled(what: str) -> Image.Image:
            browser.wait(f"deadwoodExplore.state.{what}?.final && !document.body.classList.contains('busy')")
            time.sleep(1.0)
            # The time taken depends more on the load of the machine that made the picture than on the tool.
            browser.ask("(() => { const e = counted; e.textContent = e.textContent.replace(/, [0-9.]+ s$/, ''); })()")
            return Image.open(io.BytesIO(browser.picture()))

        browser.click(*at(150.0, 400.0))
        keep(settled("base"), "explore")
        browser.key("b")
        for place in ((110.0, 200.0), (150.0, 196.0), (190.0, 200.0)):
            browser.click(*at(*place))
        browser.click(*at(190.0, 200.0), count=2)
        settled("after")
        browser.key("5")
        keep(settled("after"), "explore_what_if")
        browser.close()
        process.terminate()


def main() -> None:
    makers = {make.__name__: make for make in (of_demo, of_sample_slope, of_calibration, of_barrier, of_explore)}
    asked = argparse.ArgumentParser(prog="python -m docs.pictures", description="Make the pictures of the site.")
    asked.add_argument("which", nargs="*", metavar="WHICH", help=f"default: all of {', '.join(makers)}")
    names = asked.parse_args().which
    if unknown := set(names) - set(makers):
        asked.error(f"{', '.join(sorted(unknown))}: no pictures of that name")
    for name in names or makers:
        with tempfile.TemporaryDirectory() as folder:
            makers[name](Path(folder))


if __name__ == "__main__":
    main()
