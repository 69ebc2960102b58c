"""The profile of a flight: terrain, path and envelope of the log, barriers, and the numbers."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from deadwood_algorithms.evaluate.flights.on_terrain import Followed
from deadwood_algorithms.evaluate.flights.parabola import outline
from deadwood_algorithms.files.pictures import with_minus
from deadwood_algorithms.schemas.looks import BARRIER, LESS_MORE, RUNS, WOOD

PATH, HIT, GROUND = RUNS[0], LESS_MORE[-1], "#8c7b6b"
LOGS_SHOWN = 6
WIDTH_IN, LEAST_IN, MOST_IN = 11.0, 4.5, 9.5


def file_name(flight_id: Any) -> str:
    """A file name that is valid on every file system."""
    return f"flight_{re.sub(r'[^0-9A-Za-z_-]+', '_', str(flight_id))}.png"


def draw(followed: Followed, path: Path) -> None:
    """Draw one flight; both axes have the same scale."""
    flight, flies = followed.flight, followed.flight.bend > 0.0
    base = float(followed.start)
    figure, axes = plt.subplots(figsize=(WIDTH_IN, LEAST_IN))
    axes.plot(followed.s, followed.ground, color=GROUND, linewidth=1.6, label="terrain")
    low = float(np.nanmin(followed.ground)) - 3.0
    axes.fill_between(followed.s, low, followed.ground, color=GROUND, alpha=0.18, linewidth=0)
    s = np.linspace(0.0, flight.distance, 400)
    if flies:
        radius = followed.mapped.diameter / 2.0
        for place in _places(followed):
            corners = outline(flight, place, followed.mapped.length, radius)
            axes.fill(corners[:, 0], base + corners[:, 1], color=WOOD, alpha=0.45, linewidth=0.6, edgecolor="#4a3320")
        axes.plot([], [], color=WOOD, linewidth=6, alpha=0.45, label="the log in flight")
        axes.plot(s, base + flight.height(s), color=PATH, linewidth=1.8, label="path of the centre of mass")
        axes.plot(s, base + flight.underside(s, radius), color=PATH, linewidth=0.9, linestyle="--", label="underside")
    else:
        launch = base + flight.fall * s
        axes.plot(s, launch, color=HIT, linewidth=1.5, linestyle="--", label="launch line")
    for place, name in ((0.0, "take-off"), (flight.distance, "landing")):
        z = float(np.interp(place, followed.s, followed.ground))
        axes.plot([place], [z], "o", color="black", markersize=5, zorder=5)
        axes.annotate(name, (place, z), xytext=(0, -13), textcoords="offset points", ha="center", va="top", fontsize=9)
    for each in followed.crossings:
        colour = BARRIER if each.clearance > 0.0 else HIT
        axes.plot([each.distance] * 2, [each.ground, each.ground + each.height], color=colour, linewidth=4, zorder=4)
        axes.annotate(
            f"barrier {each.barrier_id}: {each.height:g} m\nclearance {each.clearance:.2f} m",
            (each.distance, each.ground),
            xytext=(-8, -14),
            textcoords="offset points",
            fontsize=9,
            ha="right",
            va="top",
            color=colour,
            zorder=6,
            bbox={"facecolor": "white", "alpha": 0.85, "linewidth": 0, "pad": 1.5},
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.8},
        )
    _finish(axes, followed, low)
    figure.savefig(path, dpi=110, bbox_inches="tight")
    plt.close(figure)


def _places(followed: Followed) -> np.ndarray:
    """Where the log is drawn: without overlap, from the take-off until its front reaches the landing."""
    flight = followed.flight
    front = 0.5 * followed.mapped.length / float(np.hypot(1.0, flight.slope(flight.distance)))
    last = max(0.0, flight.distance - front)
    along = last * float(np.hypot(1.0, flight.rise / flight.distance))
    count = int(np.clip(1 + along / (1.15 * followed.mapped.length), 1, LOGS_SHOWN))
    return np.linspace(0.0, last, count)


def _finish(axes: Axes, followed: Followed, low: float) -> None:
    record = followed.record()
    source = record["angle_from"]
    axes.set_aspect("equal")
    axes.set_xlim(followed.s[0], followed.s[-1])
    axes.set_ylim(bottom=low)
    tall = WIDTH_IN * (axes.get_ylim()[1] - low) / (followed.s[-1] - followed.s[0])
    assert axes.figure is not None
    axes.figure.set_size_inches(WIDTH_IN, float(np.clip(tall + 1.6, LEAST_IN, MOST_IN)))  # type: ignore[union-attr]
    axes.set_xlabel("distance along the flight [m]")
    axes.set_ylabel("height [m]")
    axes.grid(color="#E5E5E5", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.legend(loc="upper right", fontsize=9, framealpha=0.9)
    title = f"Flight {record['flight_id']}: {record['verdict'].replace('_', ' ')}"
    if followed.flight.bend > 0.0:
        title += (
            f"\ntake-off {record['takeoff_speed_ms']:.1f} m/s at {record['takeoff_deg']:.1f}° ({source}), "
            f"{record['duration_s']:.2f} s, {record['distance_m']:.1f} m away, {record['fall_m']:.1f} m down, "
            f"landing {record['landing_speed_ms']:.1f} m/s at {record['landing_deg']:.1f}°"
        )
    axes.set_title(with_minus(title), loc="left", fontsize=10.5, linespacing=1.4)
