"""Fit the flight of a log between mapped take-off and landing points: did it jump, how fast, and over which barrier?

The two points on the terrain and the take-off angle define one parabola (paper, section 5.2). The angle is that of the
terrain before the take-off, in the direction of the flight, because a sliding log leaves the ground along it; or it is
given. The layer ``flights`` holds the path of the centre of mass with take-off speed, duration, apex, landing speed and
angle, the largest height above the terrain, and a ``verdict``. With barriers, the layer ``clearances`` gives how far
the underside of the log, with its axis parallel to the velocity, passes above the top of each barrier that the flight
crosses. ``--plots`` draws a profile of each flight.

Verdicts: ``above_launch_line`` (the landing point is not below the line along which the log takes off: no speed reaches
it), ``cuts_terrain`` (the ground in between protrudes into the flight by more than ``--tolerance-m``),
``hits_barrier``, or ``possible``. A flight is a line from take-off to landing, or two points that share a ``flight_id``
and have the ``role`` takeoff and landing (if there are only two points, neither is needed). The centre of mass is half
a DBH above the ground at both ends. Columns ``takeoff_deg``, ``dbh_cm`` and ``length_m`` override the options.

The speed depends on the angle: try a few degrees more and less. The paper's log flew at 24 m/s over a barrier of 3.5 m;
this one, from the cliff band of the sample, at about the same speed:

    deadwood-tool fit-flight --dem sample_data/dem.tif --flights 'sample_data/sample.gpkg|layername=flights' \\
        --barriers 'sample_data/sample.gpkg|layername=barriers' --output flights.gpkg --plots profiles

Air drag and spin are not modelled. As in the paper the centre of mass comes down at the landing point, although the
front of a steeply falling log touches earlier; where ``free`` in ``clearances`` is 0, one end of the log is on the
ground while it passes.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool
from deadwood_algorithms.results.identity import writing


@dataclass(frozen=True, kw_only=True)
class Ask:
    dem: str = tool.terrain("Terrain (DEM)")
    flights: str = tool.vector("Lines from take-off to landing, or points of both", "line", "point")
    barriers: str | None = tool.vector("Barriers", "line", default=None)
    dbh_cm: float = tool.number("DBH, where the layer has none", unit="cm", default=75.0, minimum=0.0, exclusive=True)
    length_m: float = tool.number(
        "Length, where the layer has none", unit="m", default=30.0, minimum=0.0, exclusive=True
    )
    takeoff_deg: float | None = tool.number(
        "Take-off angle, upward positive, where the layer has none",
        unit="°",
        default=None,
        minimum=-85.0,
        maximum=85.0,
        help="Without it: the slope of the terrain in the direction of the flight.",
    )
    slope_over_m: float = tool.number(
        "Distance before the take-off over which that slope is measured",
        unit="m",
        default=5.0,
        minimum=0.0,
        exclusive=True,
    )
    tolerance_m: float = tool.number(
        "Depth to which the terrain may protrude into a flight", unit="m", default=0.3, minimum=0.0
    )
    crs: str | None = tool.crs()
    overwrite: bool = tool.overwrite()
    output: str = tool.output_vector("Flights and clearances (.gpkg)")
    plots: str | None = tool.output_folder("Folder of the profiles", default=None)


def run(ask: Ask, feedback: Feedback) -> Outcome:
    import geopandas

    from deadwood_algorithms.evaluate.flights.from_layers import FlightDefaults, read_flight_barriers, read_flights
    from deadwood_algorithms.evaluate.flights.on_terrain import follow
    from deadwood_algorithms.files.dem_windows import open_windows
    from deadwood_algorithms.files.vectors import write_vector

    with ExitStack() as stack:
        made = stack.enter_context(writing(TOOL, ask, feedback))
        path, folder = made.file("output", ".gpkg"), made.optional_folder("plots")
        dem = stack.enter_context(open_windows(ask.dem, crs=ask.crs, feedback=feedback, look_through=False))
        flights = read_flights(ask.flights, ask.crs, tool.taken(ask, FlightDefaults), dem, feedback)
        barriers = read_flight_barriers(ask.barriers, ask.crs, dem, feedback)

        followed = [
            follow(mapped, barriers, dem, slope_over_m=ask.slope_over_m, tolerance_m=ask.tolerance_m)
            for mapped in flights
        ]

        crossings = [crossing for each in followed for crossing in each.crossings]
        layers = {
            "flights": geopandas.GeoDataFrame(
                [each.record() for each in followed], geometry=[each.path() for each in followed], crs=dem.plan_crs
            )
        }
        if crossings:
            layers["clearances"] = geopandas.GeoDataFrame(
                [each.record() for each in crossings], geometry=[each.place for each in crossings], crs=dem.plan_crs
            )
        write_vector(path, layers)
        if folder:
            from deadwood_algorithms.evaluate.flights.parabola_figure import draw, file_name

            for each in followed:
                draw(each, folder / file_name(each.mapped.flight_id))
    outputs = {"output": Path(ask.output)} | ({"plots": Path(ask.plots)} if ask.plots else {})
    lines = tuple(line for each in followed for line in each.lines())
    return Outcome(outputs, {"flights": [each.record() for each in followed]}, lines)


TOOL = Tool(
    "fit-flight",
    "Evaluate",
    "Reconstruct a flight between take-off and landing: speed and clearances",
    Ask,
    run,
    then="deadwood-tool calibrate-friction --help",
)
