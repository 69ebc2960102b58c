"""Make the solid of one log, or of a rock, with its mass, centre of mass and inertia, as files for other programs.

The folder holds ``log.pts`` (the custom shape of RAMMS::Rockfall: x y z on each line, no header), ``log.obj`` and
``log.stl`` (closed, outward oriented), and ``log.json`` with the mass properties. The origin is the centre of mass, z
runs along the axis from the base to the tip, and all lengths are in metres. The log is the paper's truncated cone
(section 3), as rings of vertices on the cone: the solid in the files is slightly slimmer than the cone, by 6.6 /
vertices^2 of its volume (2.6 % with 16). ``log.json`` has both: ``cone`` exactly, and ``solid`` as in the files.

Rings in between do not change the solid. But where only vertices are tested against the ground, as RAMMS does with a
custom shape, a body has contact only at its rings. The paper slides its logs in this way, as a body-fixed cloud of
vertices. The default is a ring every half metre (``--ring-spacing-m``): on rough ground (cells of 1 m, heights
scattered by 0.15 m) logs of 15 m with rings at their two ends only come to rest with the ground 29 cm deep inside them
(median of 144; at most 59 cm), with a ring every half metre 2 cm (at most 10). ``--rings`` sets the number of rings
instead. The logs of the paper, Klosters and Rothenbrunnen:

    deadwood-tool make-log --dbh-cm 75 --length-m 30 --output log_klosters
    deadwood-tool make-log --dbh-cm 30 --length-m 15 --output log_rothenbrunnen

``slide-logs --shape log_klosters/log.pts`` slides that cloud instead of the smooth cone: the paper's method beside this
toolbox's own. (``reproduce-paper`` has 31 rings on both logs, as when its table was measured.) Bark, branches, root
plates and bends are not made.

With a width and a height the solid is a rock: the norm body of tests of nets (ETAG 027), a box whose edges and corners
are cut off at a quarter of its sides, with 24 corners and 71 % of the box's volume. ``sample_data`` has two of 1 m3.

    deadwood-tool make-log --length-m 0.46 --width-m 0.30 --height-m 0.20 --output rock
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError

Array = NDArray[np.float64]

Made = tuple[Array, NDArray[np.int64], dict[str, Any], tuple[str, ...]]  # points, triangles, facts, lines to print

MOST_RINGS = 1000
MOST_SLENDER = 10  # length of a rock over its smaller side; beyond, the length of a log was probably left as it is
LOG_KG_M3, ROCK_KG_M3 = 300.0, 2650.0
POINTS, OBJ, STL, FACTS, MANIFEST = "log.pts", "log.obj", "log.stl", "log.json", "manifest.json"


@dataclass(frozen=True, kw_only=True)
class Ask:
    dbh_cm: float = tool.number("DBH, the diameter of the base", unit="cm", default=75.0, minimum=0.0, exclusive=True)
    length_m: float = tool.number("Length", unit="m", default=30.0, minimum=0.0, exclusive=True)
    taper: float = tool.number(
        "Diameter of the tip over that of the base", default=0.5, minimum=0.0, maximum=1.0, exclusive=True
    )
    density_kg_m3: float | None = tool.number(
        "Density",
        unit="kg/m³",
        default=None,
        minimum=0.0,
        exclusive=True,
        help=f"If it is not given, {LOG_KG_M3:g} for a log and {ROCK_KG_M3:g} (granite) for a rock.",
    )
    vertices: int = tool.integer("Vertices of each ring", default=16, minimum=3, maximum=1000)
    ring_spacing_m: float = tool.number(
        "Largest distance of the rings", unit="m", default=0.5, minimum=0.0, exclusive=True
    )
    rings: int | None = tool.integer(
        "Rings, those of the two ends included, instead of a distance", default=None, minimum=2, maximum=MOST_RINGS
    )
    width_m: float | None = tool.number(
        "Width of a rock",
        unit="m",
        default=None,
        minimum=0.0,
        exclusive=True,
        help="With it and a height a rock is made instead of a log: options of logs do not count.",
    )
    height_m: float | None = tool.number("Height of a rock", unit="m", default=None, minimum=0.0, exclusive=True)
    output: str = tool.output_folder("Folder of the log")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.results.identity import result_folder
    from deadwood_algorithms.results.run_folder import write_json

    make = rock_of if ask.width_m is not None or ask.height_m is not None else log_of
    points, triangles, facts, lines = make(ask, feedback)
    with result_folder(TOOL, ask, feedback) as folder:
        write_points(folder / POINTS, points)
        write_obj(folder / OBJ, points, triangles)
        write_stl(folder / STL, points, triangles)
        write_json(folder / FACTS, facts)
    final = Path(ask.output)
    parts = {"points": POINTS, "obj": OBJ, "stl": STL, "facts": FACTS, "manifest": MANIFEST}
    return Outcome({"output": final} | {key: final / name for key, name in parts.items()}, facts, lines)


def log_of(ask: Ask, feedback: Feedback) -> Made:
    """The log, with its centre of mass at the origin."""
    from deadwood_algorithms.prepare.log_solid import frustum, properties_of_cone, properties_of_solid

    rings = ask.rings or rings_of(ask.length_m, ask.ring_spacing_m)
    diameter, density = ask.dbh_cm / 100.0, ask.density_kg_m3 or LOG_KG_M3
    if ask.length_m < diameter:
        feedback.warn(
            f"--length-m {ask.length_m:g} is less than the DBH, {diameter:g} m: this is a slice, not a log",
            code="slice",
            length_m=ask.length_m,
        )
    cone = properties_of_cone(diameter, ask.length_m, ask.taper, density)
    points, triangles = frustum(diameter, ask.length_m, ask.taper, ask.vertices, rings)
    solid = properties_of_solid(points, triangles, density)
    points[:, 2] -= solid.centre_from_base_m
    facts = {
        "frame": "origin at the centre of mass, z along the axis from the base to the tip, metres",
        "cone": cone.as_dict(),
        "solid": {"vertices": len(points), "triangles": len(triangles), **solid.as_dict()},
    }
    lines = (
        f"{'':8}{'volume':>12}{'mass':>13}{'centre from base':>18}{'inertia along':>19}{'across the axis':>19}",
        *(
            f"{name:8}{of.volume_m3:9.4f} m³{of.mass_kg:10.1f} kg{of.centre_from_base_m:16.3f} m"
            f"{of.inertia_axial_kg_m2:13.6g} kg m²{of.inertia_transverse_kg_m2:13.6g} kg m²"
            for name, of in (("cone", cone), ("solid", solid))
        ),
    )
    return points, triangles, facts, lines


def rock_of(ask: Ask, _: Feedback) -> Made:
    """The rock, with its centre of mass at the origin."""
    from deadwood_algorithms.prepare.log_solid import norm_body, properties_of_rock

    if ask.width_m is None or ask.height_m is None:
        given, missing = ("--height-m", "--width-m") if ask.width_m is None else ("--width-m", "--height-m")
        raise UserError(f"{given} is that of a rock, which needs {missing}, too")
    thin = min(ask.width_m, ask.height_m)
    if ask.length_m > MOST_SLENDER * thin:
        raise UserError(
            f"--length-m is {ask.length_m:g} m, more than {MOST_SLENDER} times the rock's smaller side, {thin:g} m; "
            "give the length of the rock"
        )
    points, triangles = norm_body(ask.length_m, ask.width_m, ask.height_m)
    rock = properties_of_rock(points, triangles, ask.density_kg_m3 or ROCK_KG_M3)
    facts = {
        "frame": "origin at the centre of mass, x along the length, y along the width, z along the height, metres",
        "rock": rock.as_dict(),
        "solid": {
            "vertices": len(points),
            "triangles": len(triangles),
            "volume_m3": rock.volume_m3,
            "mass_kg": rock.mass_kg,
        },
    }
    lines = (
        f"{'':8}{'volume':>12}{'mass':>13}{'inertia about length':>23}{'width':>19}{'height':>19}",
        f"{'rock':8}{rock.volume_m3:9.4f} m³{rock.mass_kg:10.1f} kg{rock.inertia_length_kg_m2:17.6g} kg m²"
        f"{rock.inertia_width_kg_m2:13.6g} kg m²{rock.inertia_height_kg_m2:13.6g} kg m²",
    )
    return points, triangles, facts, lines


def rings_of(length: float, spacing: float) -> int:
    """Number of evenly spaced rings at most this spacing [m] apart; 1e-9 of it lets 0.1 m divide 0.3 m into three."""
    rings = max(2, math.ceil(length / spacing - 1e-9) + 1) if length / spacing < MOST_RINGS else MOST_RINGS + 1
    if rings > MOST_RINGS:
        raise UserError(
            f"--ring-spacing-m {spacing:g} makes more than {MOST_RINGS} rings on a log of {length:g} m; take a wider "
            "spacing"
        )
    return rings


def write_points(path: Path, points: Array) -> None:
    """The custom shape of RAMMS::Rockfall: ``x y z`` a line, without a header."""
    _write(path, (f"{x:.9g} {y:.9g} {z:.9g}" for x, y, z in points))


def write_obj(path: Path, points: Array, triangles: NDArray[np.int64]) -> None:
    """Wavefront OBJ; its indices count from 1."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in points]
    _write(path, iter(lines + [f"f {i} {j} {k}" for i, j, k in triangles + 1]))


def write_stl(path: Path, points: Array, triangles: NDArray[np.int64]) -> None:
    """STL as text, the normals pointing outwards."""
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]

    def lines() -> Iterator[str]:
        yield "solid log"
        for normal, triangle in zip(normals, corners, strict=True):
            yield "facet normal {:.9g} {:.9g} {:.9g}".format(*normal)
            yield "outer loop"
            yield from ("vertex {:.9g} {:.9g} {:.9g}".format(*corner) for corner in triangle)
            yield "endloop"
            yield "endfacet"
        yield "endsolid log"

    _write(path, lines())


def _write(path: Path, lines: Iterator[str]) -> None:
    path.write_text("".join(f"{line}\n" for line in lines), encoding="ascii", newline="\n")


TOOL = Tool(
    "make-log",
    "Prepare",
    "Write the solid of a log or a rock and its mass properties: .pts, OBJ, STL",
    Ask,
    run,
    then="deadwood-tool slide-logs --dem DEM --releases RELEASES --shape {output}/log.pts --friction 0.25 --output run",
)
