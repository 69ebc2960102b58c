"""The folder of a variation: its tables, the picture, and the facts of ``summary.json``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas

from deadwood_algorithms.evaluate.sensitivity.answer import Answer, Measured
from deadwood_algorithms.evaluate.sensitivity.design import Place
from deadwood_algorithms.evaluate.sensitivity.factor_runs import SlidRuns, table_of
from deadwood_algorithms.evaluate.sensitivity.factors import Factor
from deadwood_algorithms.evaluate.sensitivity.file_names import FACTS, INDICES, PICTURE, RUNS, TORNADO
from deadwood_algorithms.evaluate.sensitivity.tables import headline, index_rows, order_of_factors, tornado_rows
from deadwood_algorithms.evaluate.sensitivity.tornado_figure import draw
from deadwood_algorithms.files.tables import write_csv
from deadwood_algorithms.results.run_folder import write_json


def write_variation(
    folder: Path,
    about: Mapping[str, Any],
    factors: list[Factor],
    places: list[Place],
    slid: SlidRuns,
    measured: list[Measured],
    answers: list[Answer],
    lines: list[Any],
    seed: int,
) -> dict[str, Any]:
    """Write the folder; returns the content of summary.json.

    about : the fidelity, the design and its rows, and the number of logs in the layer
    """

    logs = slid.runout.shape[1]
    head, order = headline(measured, answers), order_of_factors(measured, answers)
    facts: dict[str, Any] = {
        "sentence": answers[head].sentence,
        "answers": [asdict(each) for each in answers],
        "logs": logs,
        "logs_in_layer": about["logs_in_layer"],
        "fidelity": about["fidelity"],
        "runs": len(places),
        "design": about["design"],
        "samples": about["samples"],
        "factors": [{"factor": each.name, "low": each.low, "high": each.high} for each in factors],
        "tornado": tornado_rows(measured, order),
        "indices": index_rows(measured, order),
    }
    write_csv(folder / RUNS, pandas.DataFrame(table_of(places, slid, factors, lines)))
    write_csv(folder / TORNADO, pandas.DataFrame(facts["tornado"]))
    if facts["indices"]:
        write_csv(folder / INDICES, pandas.DataFrame(facts["indices"]))
    write_json(folder / FACTS, facts)
    note = (
        "High minus low end with its 95 % interval over the same logs, bold where that excludes 0. Values of a range "
        f"count as equally likely. As it is: {logs} of {facts['logs_in_layer']} logs, fidelity {facts['fidelity']}, "
        f"seed {seed}."
    )
    if any(each.indices is not None and each.indices.crossed.any() for each in measured):
        note += (
            " Where both indices of a factor are equal, the samples are too few to tell them apart: raise --samples."
        )
    draw(folder / PICTURE, measured, answers, order, logs, len(places), note)
    return facts
