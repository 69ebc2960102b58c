"""A part of a run's logs slid again over the plausible friction, and in another posture if that is assumed.

How many logs follows from the cost of the fidelities alone, so that equal runs have equal bands; about `SHARE` of the
time of the run.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from deadwood_algorithms.ensemble.variants import Ensemble, joined
from deadwood_algorithms.evaluate.sensitivity.design import Place
from deadwood_algorithms.evaluate.sensitivity.factor_runs import variants_of
from deadwood_algorithms.files.embedded import record_in
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.presets import plausible_range
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.results.friction_band import OTHER_POSTURE, Member, SlidBand
from deadwood_algorithms.results.scenario import posture_shares
from deadwood_algorithms.scene.friction import ends_of, number_of
from deadwood_algorithms.simulate.fidelity_trade import COSTS
from deadwood_algorithms.simulate.log_order import hash_order
from deadwood_algorithms.simulate.sinking import Sinking
from deadwood_algorithms.simulate.sliding import metered
from deadwood_algorithms.simulate.steps import Unkept
from deadwood_engine import FIDELITIES

if TYPE_CHECKING:
    from deadwood_algorithms.simulate.chunks import ChunkedRun

SHARE = 0.4  # of the time that as many logs of the run take, by the costs of the fidelities (0.3 took 22 % of a run's)
FEWEST = 20  # logs: fewer show no difference


def friction_ends(given: str | None, friction: str | float, preset: str | None) -> tuple[float, float] | None:
    """The ends of ``--friction-range``; None without it."""
    if given is None:
        return None
    own, text = number_of(friction), given.strip().lower()
    if own is None:
        raise UserError(
            f"--friction-range needs a friction that is a number, but {friction} is a layer; vary it with "
            "deadwood-tool vary --vary friction_factor"
        )
    if text == "auto":
        return plausible_range(own, preset)
    low, high = ends_of(text.replace(":", "-")) or (math.nan, math.nan)
    if not low < high:
        raise UserError(f"--friction-range is '{given}', but must be LOW-HIGH, such as 0.2-0.3, or auto")
    if not low <= own <= high:
        raise UserError(f"--friction-range {low:g} to {high:g} does not contain the run's friction, {own:g}")
    return low, high


def slid_band(
    done: ChunkedRun, ends: tuple[float, float] | None, fidelity: str, seed: int, feedback: Feedback
) -> SlidBand | None:
    """Slide the logs of the band; None without ends, or with too few logs.

    fidelity : the name of the run's
    """
    if ends is None:
        return None
    rows, _ = done.queue.slid_rows()
    slid, layers = done.releases.take(rows), done.slope.layers
    own = number_of(done.simulation.inputs.friction)
    assert own is not None  # `friction_ends` refuses a layer
    shares = posture_shares(slid)
    posture = max(shares, key=lambda each: shares[each])
    places = [Place(f"friction {each:g}", {"friction": each}) for each in ends if each != own]
    if layers.shape is None and is_assumed(done.simulation.inputs.releases):
        other = OTHER_POSTURE.get(posture, "upright")
        places.append(Place(other, {"orientation": other}))
    at_draft = done.simulation.fidelity == FIDELITIES["draft"]
    places = places if at_draft else [Place("unchanged", {}), *places]
    n = min(len(slid), int(SHARE * len(slid) * COSTS.get(fidelity, 1.0) / (COSTS["draft"] * max(1, len(places)))))
    if n < FEWEST:
        feedback.warn(
            f"--friction-range: a third of the time of {counted(len(slid), 'log')} is enough for {n} of them at "
            f"{counted(len(places), 'place')}, which show no difference; release more",
            code="few-logs-for-band",
            logs=n,
            needed=FEWEST,
        )
        return None
    feedback.note(f"--friction-range: {counted(n, 'log slides', 'logs slide')} {len(places)} times more at draft")
    logs = slid.take(hash_order(slid.logs.log_id, seed)[:n])
    draft = replace(done.simulation, fidelity=FIDELITIES["draft"], counts_danger=False, sinking=Sinking())
    ensemble = Ensemble(draft, layers, slid, logs, feedback)
    with metered() as meter:
        found = ensemble.slide(variants_of(places, draft, 0.0, seed), ("reach",), Unkept())
    reach = [joined(parts, "reach") for parts in found]
    members = [
        Member(float(place.values.get("friction", own)), str(place.values.get("orientation", posture)), each)
        for place, each in zip(places, reach, strict=True)
    ]
    unchanged = None if at_draft else reach[0]
    return SlidBand(logs.logs.log_id, own, posture, unchanged, tuple(members[not at_draft :]), meter.cpu_s)


def is_assumed(releases: str) -> bool:
    """Whether nobody stated the posture of these logs: no column has it, or sample-releases took its default."""
    import pyogrio

    path, _, layer = releases.partition("|layername=")
    record = record_in(Path(path)) or {}
    if record.get("tool") == "sample-releases":
        return record.get("parameters", {}).get("orientation") == "upright"
    info = pyogrio.read_info(path, layer=layer or None)
    return "orientation" not in [str(each).lower() for each in info["fields"]]
