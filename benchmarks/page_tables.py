"""The tables of the page, one function each, from the results file."""

from __future__ import annotations

from deadwood_algorithms.stats.statistics import to_decimals

from . import tables
from .settings import FACTORS, ROLLING, SETTINGS, Setting
from .tables import FIDELITIES, Row, number, span, table

# Columns of the two tables of depths
DEPTHS = ["fidelity", "logs", "CPU ms per log", "penetration: median [cm]", "99 %", "deepest", "deepest by sampling"]
DEPTHS += ["energy error, largest", "failed logs"]


def fidelity_table(results: Row) -> str:
    """One row for each fidelity: cost, difference, jump height, hit raster, penetration over the pooled scenes."""
    rows = []
    for name in FIDELITIES:
        entries = [mine[name] for scene, mine in tables.in_order(results) if scene in tables.POOLED and name in mine]
        if not entries:
            continue
        found = tables.pooled(results, name)
        hits = list(tables.raster_ratios(results, name).values())
        deep = [e["penetration_m"] for e in entries]
        jumps = list(tables.jump_errors(results, name).values())
        compared = [tables.with_interval(found), tables.worst_of(found), tables.in_friction(results, found)]
        rows.append(
            [
                f"`{name}`",
                span([e["cpu_ms_per_log"] for e in entries]),
                f"{tables.relative_cost(results, name):.2g}",
                *(compared if found else ["0, by definition", "", ""]),
                f"{to_decimals(min(jumps), 0, sign=True)} to {to_decimals(max(jumps), 0, sign=True)}" if jumps else "",
                span(hits) if hits else "",
                f"{100 * max(d['median'] for d in deep):.1f} / {100 * max(d['max'] for d in deep):.0f}",
            ]
        )
    head = ["fidelity", "CPU ms per log", "cost", "reach minus `reference`, mean of scenes [points]", "worst scene"]
    head += ["equivalent change of mu", "jump height that 95 % of logs stay below, minus `reference`'s [%], by scene"]
    head += ["hit raster, distance / noise", "penetration, median / deepest [cm]"]
    return table(head, rows)


def factor_table(results: Row) -> str:
    """One row for each setting other than the fidelities."""
    rows = [
        [
            FACTORS[row["group"]][0],
            f"`{row['name']}`",
            row["against"],
            f"{row['cost']:.2g}",
            tables.with_interval(row),
            tables.worst_of(row),
            tables.in_friction(results, row),
            f"{100 * row['discordant']:.0f} %",
            "five" if len(row["scenes"]) == len(tables.POOLED) else ", ".join(row["scenes"]),
            str(row["logs"]),
        ]
        for row in tables.pooled_rows(results)
        if row["group"] not in ("fidelity", "impacts", "rings")
    ]
    head = ["factor", "setting", "against", "cost", "difference of reach, mean of scenes [points]", "worst scene"]
    return table([*head, "equivalent change of mu", "logs that disagree", "scenes", "logs per scene"], rows)


def _share(record: Row) -> str:
    return f"{100 * record['p']:.1f} ({100 * record['low']:.1f} to {100 * record['high']:.1f})"


def _worst_line(error: Row) -> str:
    worst = error["worst_line"]
    return f"{tables.points(worst['delta'])} at y {worst['y']:g} m"


def scene_table(results: Row) -> str:
    """Every scene at every fidelity: cost and reach."""
    rows = []
    for scene, name, e in tables.fidelities_of(results):
        f = e.get("error")
        row = [scene, f"`{name}`", str(e["logs"]), number(e["cpu_ms_per_log"]), number(e["us_per_step"])]
        row += [f"{e['steps_per_log']:.0f}", _share(e["reach"])]
        rows.append([*row, tables.with_interval(f["reach"]) if f else "", _worst_line(f) if f else ""])
    head = ["scene", "fidelity", "logs", "CPU ms per log", "µs per step", "steps per log", "reach [%]"]
    return table([*head, "minus reference [points]", "largest of all lines"], rows)


def _difference(record: Row, digits: int = 2) -> str:
    value, low, high = (to_decimals(record[name], digits, sign=True) for name in ("difference", "low", "high"))
    return f"{value} ({low} to {high})"


def field_table(results: Row) -> str:
    """Every scene at every fidelity: distances of distributions from the reference's."""
    rows = []
    for scene, name, entry in tables.fidelities_of(results):
        f = entry.get("error")
        if not f:
            continue
        hits = f"{f['hits_jaccard']:.3f} / {f['hits_jaccard_floor']:.3f}" if "hits_jaccard_floor" in f else ""
        row = [scene, f"`{name}`", str(f["logs"]), f"{f['runout_w1_m']:.2f} / {f['runout_w1_floor_m']:.2f}"]
        row += [f"{f['deposit_energy_m']:.3f} / {f['deposit_energy_floor_m']:.3f}", hits]
        row += [_difference(f["spread_deg"], 1), _difference(f["speed_95_ms"]), _difference(f["jump_95_m"])]
        rows.append(row)
    head = ["scene", "fidelity", "logs", "runout W1 / noise [m]", "deposits, energy distance / noise [m]"]
    head += ["hit raster, Jaccard / noise", "spread 5-95 % [deg]", "top speed, 95 % of logs [m/s]"]
    return table([*head, "jump height, 95 % of logs [m]"], rows)


def health_table(results: Row) -> str:
    """Every scene at every fidelity: penetration, energy, convergence."""
    rows = []
    for scene, name, e in tables.fidelities_of(results):
        deep, energy = e["penetration_m"], e["energy_error"]
        row = [scene, f"`{name}`", *(f"{100 * deep[k]:.1f}" for k in ("median", "p99", "max"))]
        row += [f"{100 * e['overlap_m']['max']:.1f}", *(f"{energy[k]:.1g}" for k in ("median", "p99", "max"))]
        row += [f"{100 * e['unconverged_share']:.3f} %", number(e["contacts_per_step"]), number(e["sweeps_per_step"])]
        rows.append([*row, f"{100 * e['airborne_share']:.0f} %", str(e["stop_reasons"]["failed"])])
    head = ["scene", "fidelity", "penetration: median [cm]", "99 %", "deepest", "deepest in trees and barriers [cm]"]
    head += ["energy error: median", "99 %", "largest", "steps unconverged", "contacts per step", "sweeps a step"]
    return table([*head, "steps in the air", "failed logs"], rows)


def cell_table(results: Row) -> str:
    """The effect of other cell sizes of the DEM on reach."""
    rows = [
        [
            r["scene"],
            number(r["cell"]),
            f"{100 * r['p']:.1f}",
            tables.with_interval(r),
            f"{r['friction']:+.3f}" if r["friction"] == r["friction"] else "-",
        ]
        for r in tables.cell_rows(results)
    ]
    return table(["scene", "cell [m]", "reach [%]", "minus 0.5 m [points]", "change of mu that undoes it"], rows)


def plane_table(results: Row) -> str:
    """The plane with each row's rings and with few."""
    rows = [
        [f"`{r['fidelity']}`", r["rings"], number(r["contacts"]), _share(r)]
        for r in results.get("plane", {}).get("rows", [])
    ]
    return table(["fidelity", "rings every", "contacts per step", "reach of the lowest line [%]"], rows)


def roll_table(results: Row) -> str:
    """The plane, by the angle that a log rolls in a step."""
    entries, rows = results["entries"].get("plane", {}), []
    for name in (*FIDELITIES, *(name for name, each in SETTINGS.items() if each.group == "roll angle")):
        found = entries.get(name, {})
        if "error" not in found:
            continue
        error, cost = found["error"], found["cpu_ms_per_log"] / entries["standard"]["cpu_ms_per_log"]
        numbers = [f"{found['fidelity']['roll_angle']:g}", f"{1e3 * found['fidelity']['time_step']:g}", f"{cost:.2g}"]
        rows.append(
            [f"`{name}`", *numbers, str(found["logs"]), tables.with_interval(error["reach"]), _worst_line(error)]
        )
    head = ["setting", "roll angle [rad]", "time step [ms]", "cost", "logs", "reach minus `reference` [points]"]
    return table([*head, "largest of all lines"], rows)


def switch_table(results: Row) -> str:
    """The engine's savings if less is required."""
    rows = [
        [
            r["what"],
            *(number(r[f"{side}_{unit}"]) for unit in ("ms_per_log", "us_per_step") for side in ("less", "more")),
            "yes" if r["same"] else f"{tables.with_interval(r['difference'])}, {r['logs']} logs",
        ]
        for r in results.get("switches", {}).get("rows", [])
    ]
    head = ["what is asked for", "ms per log without", "with", "µs per step without", "with"]
    head += ["same bits, or reach with minus without [points]"]
    return table(head, rows)


def ring_table(results: Row) -> str:
    """Rings of vertices against the smooth cone."""
    rows = [
        [
            scene,
            _log_of(SETTINGS[name]),
            str(entry["logs"]),
            _share(entry["reach"]),
            tables.with_interval(entry["error"]["reach"]) if "error" in entry else "",
            number(entry["cpu_ms_per_log"]),
        ]
        for scene, name, entry in tables.entries_of(results, "rings")
    ]
    return table(["scene", "log", "logs", "reach [%]", "minus the first [points]", "CPU ms per log"], rows)


def _log_of(setting: Setting) -> str:
    if setting.vertices:
        return f"{setting.vertices} vertices a ring"
    return f"smooth cone, friction of rolling {dict(setting.options).get('rolling_friction', ROLLING):g}"


def impact_table(results: Row) -> str:
    """The fidelities if everything rebounds."""
    rows = [
        [
            scene,
            f"{SETTINGS[name].value:g}",
            f"`{name.split()[0]}`",
            str(entry["logs"]),
            number(entry["cpu_ms_per_log"]),
            _share(entry["reach"]),
            tables.with_interval(entry["error"]["reach"]) if "error" in entry else "",
            f"{100 * entry['stop_reasons']['time_limit'] / entry['logs']:.1f}",
        ]
        for scene, name, entry in tables.entries_of(results, "impacts")
    ]
    head = ["scene", "restitution", "fidelity", "logs", "CPU ms per log", "reach [%]", "minus reference [points]"]
    return table([*head, "at the time limit [%]"], rows)


def rebound_table(results: Row) -> str:
    """Logs that slide against a rigid barrier, by restitution and fidelity."""
    rows = [
        [f"{r['e']:g}", *_depths(r), f"{100 * r['overlap_m']:.1f}", str(r["through"]), _share(r["past"])]
        for r in results.get("rebounds", {}).get("rows", [])
    ]
    head = ["restitution", *DEPTHS, "deepest in the barrier [cm]", "logs that are through it", "past it [%]"]
    return table(head, rows)


def noise_table(results: Row) -> str:
    """Depth on ground of white noise, by fidelity."""
    return table(DEPTHS, [_depths(r) for r in results.get("noise", {}).get("rows", [])])


def _depths(row: Row) -> list[str]:
    deep = [f"{100 * row['penetration_m'][k]:.1f}" for k in ("median", "p99", "max")]
    found = [f"`{row['fidelity']}`", str(row["logs"]), number(row["cpu_ms_per_log"]), *deep]
    return [*found, f"{100 * row['sampled_m']['max']:.1f}", f"{row['energy_error']:.1g}", str(row["failed"])]


def sensitive_table(results: Row) -> str:
    """All results of the sensitive case."""
    rows = [
        [
            f"`{name}`",
            e["against"] if "error" in e else "",
            str(e["logs"]),
            number(e["cpu_ms_per_log"]),
            _share(e["reach"]),
            tables.with_interval(e["error"]["reach"]) if "error" in e else "",
        ]
        for name, e in tables.in_plan(results, "sensitive")
        if tables.group_of(name) != "rings"
    ]
    head = ["setting", "against", "logs", "CPU ms per log", "reach [%]", "difference [points]"]
    return table(head, rows)


def peer_table(results: Row) -> str:
    """Other engines on two of our jobs."""
    rows = [
        [
            r["engine"],
            r["setting"],
            f"{r['distance_error_m']:+.2f}",
            number(r["ms_per_log"]),
            f"{r['median_descent_m']:.0f}",
            str(r["lost"]),
        ]
        for r in results.get("peers", {}).get("rows", [])
    ]
    head = [
        "engine",
        "setting",
        "plane: distance minus exact [m]",
        "rough: CPU ms per log",
        "rough: median descent [m]",
    ]
    return table([*head, "rough: lost logs"], rows)
