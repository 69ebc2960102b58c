"""The figures of the report: each drawn once, inserted into the page as SVG, and written as PNG, SVG and PDF on
request.

Colours are those of `schemas/looks.py`: a run has one in every chart. Text and axes take the colour of the page
(`inline_svg`), so that a figure fits a light page and a dark one.
"""

from __future__ import annotations

import base64
import io
import re
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import matplotlib
import numpy as np
import shapely
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator, ScalarFormatter
from numpy.typing import NDArray
from PIL import Image

from deadwood_algorithms.report.markup import Markup, escaped, picture_address
from deadwood_algorithms.report.profiles import Profile
from deadwood_algorithms.report.rounded import share_of
from deadwood_algorithms.report.sources import ReportedRun
from deadwood_algorithms.report.words import Words
from deadwood_algorithms.schemas.looks import WOOD
from deadwood_algorithms.stats.directions import spread_of_release
from deadwood_algorithms.stats.order_statistics import LEAST_OF_A_FIGURE, quantiles

INK = "#0a0b0c"  # stands for the page's text colour
WIDTH = 7.2  # inches, of a figure as wide as the page
TEXT = 9.5  # points; on paper a figure is printed at 0.7 of its size at least (`page.css`), which gives at least 6.5
STYLE: Any = {
    "svg.fonttype": "none",
    "legend.fontsize": TEXT,
    "svg.hashsalt": "deadwood",
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": TEXT,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#8a8a8a",
    "grid.alpha": 0.25,
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "path.simplify": False,
    "image.composite_image": False,  # otherwise overlapping layers are merged into one
}
# Of a histogram, by the style of their lines
PERCENTILES: dict[Literal["-", ":"], tuple[int, ...]] = {"-": (50,), ":": (5, 95)}
LABEL = 40  # letters of an axis label beside which another figure stands
PROFILE_IN = 3.6  # of the width that a profile takes


class _Ticks(ScalarFormatter):
    """Matplotlib's own numbers, with the language's decimal sign."""

    def __init__(self, words: Words) -> None:
        super().__init__()
        self.words = words

    def __call__(self, x: float, pos: int | None = None) -> str:
        return self.words.signs(super().__call__(x, pos))


@dataclass(frozen=True)
class Drawing:
    """A figure by name; ``draw`` redraws it for each use."""

    name: str
    title: str
    draw: Callable[[], Figure]
    words: Words

    def made(self) -> Figure:
        with matplotlib.rc_context(STYLE):
            figure = self.draw()
            for axes in figure.axes:
                for axis in (axes.xaxis, axes.yaxis):
                    if type(axis.get_major_formatter()) is ScalarFormatter:
                        axis.set_major_formatter(_Ticks(self.words))
            return figure

    def inline(self) -> Markup:
        return inline_svg(self.made(), self.name, self.title)

    def write(self, folder: Path) -> list[Path]:
        """PNG, SVG and PDF, on white."""
        figure = self.made()
        with matplotlib.rc_context(STYLE):
            paths = [folder / f"{self.name}.{ending}" for ending in ("png", "svg", "pdf")]
            for path in paths:
                facts: dict[str, Any] = {"Date": None} if path.suffix == ".svg" else {}
                facts = {"CreationDate": None} if path.suffix == ".pdf" else facts
                figure.savefig(path, dpi=200, metadata=facts, facecolor="white")
        return paths


def inline_svg(figure: Figure, name: str, title: str) -> Markup:
    """A figure as SVG for the page: no header, unique ids, short numbers, the page's colour for ink."""
    with matplotlib.rc_context(STYLE):
        out = io.StringIO()
        figure.savefig(out, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    text = out.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.S)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.S)
    used = set(re.findall(r'(?:url\(#|href="#)([^")]+)', text))
    there: set[str] = set()

    def named(found: re.Match[str]) -> str:
        """The requested ids, each once: Matplotlib defines identical content twice if it occurs in two places."""
        if found[1] in there or not (found[1] in used or found[1].startswith("layer_")):
            return ""
        there.add(found[1])
        return f' id="{name}-{found[1]}"'

    text = re.sub(r' id="([^"]+)"', named, text)
    text = re.sub(r'(url\(#|href="#)([^")]+)', lambda found: f"{found[1]}{name}-{found[2]}", text)
    text = re.sub(r'data:image/png;base64,([^"]+)', lambda found: _packed_picture(found[1]), text)
    # Half a hundredth of a point is invisible; images keep their precision, otherwise they would not fit together.
    text = re.sub(r'(?<= d=")[^"]+', lambda found: _shortened(found[0]), text)
    text = text.replace(INK, "currentColor")
    width, height = re.search(r'width="([\d.]+)pt" height="([\d.]+)pt"', text).groups()  # type: ignore[union-attr]
    text = text.replace(
        f'width="{width}pt" height="{height}pt"',
        f'class="figure" style="--own:{width}pt;max-width:{width}pt" role="img" aria-label="{escaped(title)}"',
        1,
    )
    return Markup(re.sub(r"\n\s*", "\n", text))


def _packed_picture(png: str) -> str:
    with Image.open(io.BytesIO(base64.b64decode(png))) as image:
        return picture_address(image)


def _shortened(path: str) -> str:
    path = re.sub(r"-?\d+\.\d+", lambda number: f"{float(number[0]):.2f}".rstrip("0").rstrip("."), path)
    return re.sub(r"\s+", " ", path)


def _panels(number: int, height: float, **more: Any) -> tuple[Figure, list[Any]]:
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    axes = figure.subplots(1, number, squeeze=False, **more)[0]
    return figure, list(axes)


def drawings_of(source: ReportedRun, words: Words, key: str, profiles: list[Profile]) -> dict[str, Drawing]:
    """The figures for which a run has data, by content."""
    kinds: list[tuple[str, bool, Callable[[], Figure]]] = [
        ("reach", bool(source.summary["reach"]), lambda: reach_figure(source, words)),
        ("arrivals", source.arrivals is not None and len(source.arrivals) > 0, lambda: arrivals_figure(source, words)),
        ("spread", bool(counted_azimuths(source)), lambda: rose_figure(source, words)),
        ("runout", True, lambda: runout_figure([source], words)),
        ("distributions", True, lambda: distributions_figure(source, words)),
        *((f"profile_{each.chosen}", True, partial(profile_figure, each, source.colour, words)) for each in profiles),
    ]
    titles = {"distributions": "ways"} | {f"profile_{each.chosen}": "profile" for each in profiles}
    return {
        kind: Drawing(f"{key}_{kind}", words.say(titles.get(kind, kind)), draw, words)
        for kind, there, draw in kinds
        if there
    }


def reach_figure(source: ReportedRun, words: Words) -> Figure:
    """One bar for each line with its 95 % interval."""
    records = source.summary["reach"][:12]
    figure, (axes,) = _panels(1, 0.8 + 0.29 * len(records))
    value = np.array([share_of(each) for each in records])
    ends = np.array([[100.0 * each["ci_low"], 100.0 * each["ci_high"]] for each in records]).T
    error = np.abs(ends - value)
    axes.barh(np.arange(value.size), value, 0.6, color=source.colour)
    axes.errorbar(value, np.arange(value.size), xerr=error, fmt="none", ecolor=INK, capsize=4, linewidth=1.2)
    axes.set_yticks(np.arange(value.size), [plain(each["line_id"]) for each in records])
    axes.set(
        xlabel=words.say("share_of_logs"),
        xlim=(0.0, min(100.5, max(1.15 * ends.max(), 1.0))),
        ylim=(value.size - 0.4, -0.6),
    )
    axes.grid(axis="y", visible=False)
    return figure


def arrivals_figure(source: ReportedRun, words: Words) -> Figure:
    """Distribution of speed, energy, height and angle over the arrivals at all lines."""
    assert source.arrivals is not None
    figure = Figure(figsize=(WIDTH, 4.5), layout="constrained")
    panels = figure.subplots(2, 2).ravel()
    for axes, (name, phrase) in zip(panels, ARRIVAL_COLUMNS.items(), strict=True):
        _histogram(axes, source.arrivals[name].to_numpy(np.float64), words.say(phrase), source.colour, words)
    _legend_of_percentiles(figure)
    return figure


ARRIVAL_COLUMNS = {
    "speed_ms": "arrival_speed",
    "energy_kj": "arrival_energy",
    "height_m": "arrival_height",
    "impact_deg": "arrival_angle",
}


def _histogram(axes: Any, values: NDArray[np.float64], label: str, colour: str, words: Words) -> None:
    """Number of logs by class, with the percentiles as lines; of too few logs only how many are missing."""
    values = values[np.isfinite(values)]
    axes.set(xlabel=textwrap.fill(label, LABEL), ylabel=words.say("n_logs"))
    axes.yaxis.set_major_locator(MaxNLocator(4, integer=True))
    if values.size < LEAST_OF_A_FIGURE:
        _needs_more(axes, values.size, words)
        return
    top = float(values.max())
    bins = max(5, min(24, round(2.0 * values.size ** (1 / 3))))
    low = 0.0 if values.min() >= 0.0 else float(values.min())
    axes.hist(values, bins=bins, range=(low, top if top > low else low + 1.0), color=colour, alpha=0.85)
    for style, levels in PERCENTILES.items():
        for each in quantiles(values, [level / 100.0 for level in levels]):
            if np.isfinite(each):
                axes.axvline(float(each), color=INK, linewidth=1.2, linestyle=style)


def _needs_more(axes: Any, n: int, words: Words) -> None:
    """Says how many more logs a figure needs, in its middle."""
    text = words.say("few_logs", n=n, more=LEAST_OF_A_FIGURE - n)
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", fontsize=TEXT)


def _legend_of_percentiles(figure: Figure) -> None:
    handles = [
        Line2D([], [], color=INK, linewidth=1.2, linestyle=style, label=", ".join(f"{each} %" for each in levels))
        for style, levels in PERCENTILES.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))


def counted_azimuths(source: ReportedRun) -> dict[str, NDArray[np.float64]]:
    """Azimuths [deg] of the deposits that count for the spread, by release; only of as many as a rose needs."""
    given = source.run.manifest.get("parameters", {}).get("min_runout_m")
    frame = source.deposits
    nearest = frame["length_m"].to_numpy(np.float64) if given is None else np.full(len(frame), float(given))
    x, y = shapely.get_coordinates(np.asarray(frame.geometry)).T
    found = {}
    release_x, release_y = (frame[f"release_{name}"].to_numpy(np.float64) for name in "xy")
    ids = frame["release_id"].astype(str).to_numpy()
    for release_id in dict.fromkeys(ids.tolist()):
        mine = ids == release_id
        centre = float(release_x[mine].mean()), float(release_y[mine].mean())
        _, azimuths, counted = spread_of_release(centre, x[mine], y[mine], nearest[mine])
        if counted.sum() >= LEAST_OF_A_FIGURE:
            found[release_id] = azimuths[counted]
    return found


def rose_figure(source: ReportedRun, words: Words) -> Figure:
    """One rose for each of the six releases with the most deposits: petals of 10 degrees, their area is the share of
    deposits.
    """
    found = sorted(counted_azimuths(source).items(), key=lambda item: -item[1].size)[:6]
    columns = min(3, len(found))
    rows = -(-len(found) // columns)
    tall = 3.2 if rows == 1 else 2.3
    figure = Figure(figsize=(min(WIDTH, 1.0 + 3.0 * columns), tall * rows), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False, subplot_kw={"projection": "polar"}).ravel()
    for axes in panels[len(found) :]:
        axes.set_axis_off()
    edges = np.radians(np.arange(0.0, 361.0, 10.0))
    for axes, (release_id, azimuths) in zip(panels, found, strict=False):
        count, _ = np.histogram(np.radians(azimuths), edges)
        axes.set_theta_zero_location("N")
        axes.set_theta_direction(-1)
        radius = np.sqrt(count / count.max())
        axes.bar(
            edges[:-1], radius, width=np.radians(10.0), align="edge", color=source.colour, edgecolor=INK, linewidth=0.3
        )
        rings = [share for share in (0.05, 0.1, 0.2, 0.4) if share <= 0.8 * count.max() / azimuths.size]
        axes.set_yticks(
            [np.sqrt(share * azimuths.size / count.max()) for share in rings], [f"{100 * share:g} %" for share in rings]
        )
        axes.set_xticks(np.radians([0, 90, 180, 270]), words.say("compass").split(","))
        axes.set_title(f"{words.say('release')} {plain(release_id)} (n = {azimuths.size})", fontsize=TEXT)
    return figure


def runout_figure(sources: list[ReportedRun], words: Words) -> Figure:
    """Share of the logs that go farther than each distance, a curve per run."""
    figure, (axes,) = _panels(1, 2.7)
    for each in sources:
        far = np.sort(each.runouts)
        if far.size < LEAST_OF_A_FIGURE:
            if len(sources) == 1:
                _needs_more(axes, far.size, words)
            continue
        share = 100.0 * (1.0 - np.arange(1, far.size + 1) / far.size)
        last = np.searchsorted(far, np.inf) - 1  # the curve ends above 0 where logs have no deposit
        keep = np.unique(np.linspace(0, last, min(last + 1, 600)).astype(int)) if last >= 0 else np.zeros(0, int)
        x, y = np.append(0.0, far[keep]), np.append(100.0, share[keep])
        axes.step(x, y, where="post", color=each.colour, linewidth=1.6, label=plain(each.name))
    axes.set(xlabel=words.say("runout_axis"), ylabel=words.say("farther"), ylim=(0.0, 102.0))
    axes.set_xlim(left=0.0)
    if len(sources) > 1:
        axes.legend()
    return figure


def distributions_figure(source: ReportedRun, words: Words) -> Figure:
    """Largest speed and jump height of each log."""
    figure, panels = _panels(2, 2.7)
    for axes, column, phrase in zip(
        panels, ("speed_max_ms", "jump_max_m"), ("max_speed_axis", "jump_axis"), strict=True
    ):
        _histogram(axes, source.column(column), words.say(phrase), source.colour, words)
    _legend_of_percentiles(figure)
    return figure


def profile_figure(profile: Profile, colour: str, words: Words) -> Figure:
    """Profile of the terrain and the path of one log, without vertical exaggeration; beside it the speed and the
    clearance, along the same path."""
    drop = float(np.ptp(profile.terrain[np.isfinite(profile.terrain)])) / float(profile.way[-1])
    tall = float(np.clip(PROFILE_IN * drop, 1.1, 2.4)) + 0.75
    figure = Figure(figsize=(WIDTH, tall + 0.3), layout="constrained")
    axes, right = figure.subplots(1, 2, gridspec_kw={"width_ratios": (1.6, 1.0)})
    low = float(np.nanmin(profile.terrain)) - 0.04 * float(profile.way[-1])
    axes.fill_between(profile.way, profile.terrain, low, color="#8a8a8a", alpha=0.3, linewidth=0)
    ground = axes.plot(profile.way, profile.terrain, color=INK, linewidth=1.0, label=words.say("terrain"))
    middle = axes.plot(profile.way, profile.z, color=colour, linewidth=1.3, label=words.say("centre"))
    axes.set(xlabel=words.say("way"), ylabel=words.say("elevation"), aspect="equal", adjustable="datalim")
    axes.set_title(words.say(f"chosen_{profile.chosen}", id=profile.log_id), loc="left", fontsize=TEXT)
    fast = right.plot(profile.way, profile.speed, color=colour, linewidth=1.1, linestyle="--", label=words.say("speed"))
    right.set(xlabel=words.say("way"), ylabel=words.say("speed_axis"), ylim=(0.0, None), xlim=(0.0, None))
    up = right.twinx()
    gap = up.fill_between(
        profile.way,
        np.fmax(profile.clearance, 0.0),
        facecolor=(WOOD, 0.55),
        edgecolor=INK,
        linewidth=0.5,
        label=words.say("clearance"),
    )
    up.set(ylabel=words.say("clearance_axis"), ylim=(0.0, 1.6 * max(float(np.nanmax(profile.clearance)), 0.5)))
    up.grid(visible=False)
    up.spines["right"].set_visible(True)
    figure.legend(handles=[*ground, *middle, *fast, gap], loc="outside lower center", ncols=4)
    return figure


def plain(text: Any) -> str:
    """A name as plain text for matplotlib: no formula, no line breaks, limited in length."""
    shown = re.sub(r"\s+", " ", str(text)).replace("$", r"\$")
    return shown if len(shown) <= 40 else shown[:39] + "…"
