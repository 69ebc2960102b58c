"""Run-outs of logs that left the terrain model: in compare-scenarios and in the report, against pandas."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hand_run import Track, write_run
from slope_case import Case, cut_above_the_road

from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.report.sources import read_reported_run
from deadwood_algorithms.tools import compare_scenarios

LOGS, LOST = 160, 24


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """The same logs twice, 20 m and more; in the second run 24 leave the terrain model 30 m from their start."""
    folder, rng = tmp_path_factory.mktemp("runouts"), np.random.default_rng(7)
    far = 20.0 + 50.0 * rng.random(LOGS)
    lost = rng.permutation(LOGS)[:LOST]
    ways = {"kept": far, "lost": np.where(np.isin(np.arange(LOGS), lost), 30.0, far)}
    found = {}
    for name, length in ways.items():
        gone = [name == "lost" and k in lost for k in range(LOGS)]
        tracks = [
            Track((5.0 + 0.2 * k, 90.0), (5.0 + 0.2 * k, 90.0 - each), stop_reason="left_dem" if left else "rest")
            for k, (each, left) in enumerate(zip(length, gone, strict=True))
        ]
        found[name] = write_run(folder / name, tracks)
    return folder, found, far


def test_a_quantile_counts_them_as_farther(runs):
    folder, found, far = runs
    compare_scenarios.TOOL(runs=f"{found['kept']},{found['lost']}", output=str(folder / "compared"))
    table = pd.read_csv(folder / "compared" / "comparison.csv", encoding="utf-8-sig")
    rows = table[(table["quantity"] == "runout") & (table["item"] == "p95")]
    assert len(rows) == 2
    values = rows.set_index("scenario")["value"]
    assert values["kept"] == pytest.approx(np.quantile(far, 0.95))
    assert np.isnan(values["lost"]), "15 % of the logs went farther than is known"


def test_the_report_counts_them_too(tmp_path):
    case = cut_above_the_road(Case(tmp_path))
    source = read_reported_run(case.run(friction="0.6", trees=case.trees), "cut", Quiet())
    deposits = source.deposits
    gone = deposits["stop_reason"].isin(["left_dem", "time_limit", "failed"])
    assert 0 < gone.sum() < len(deposits)
    assert source.runouts.tolist() == deposits["runout_m"].where(~gone, np.inf).tolist()
