"""Each site reports lost logs like its own run, and the sum of all sites the possible effect of all lost logs."""

from __future__ import annotations

import pytest

from deadwood_algorithms.evaluate.sites.overview import SiteFound, SiteRow, reach_of_all, words_of_sites
from deadwood_algorithms.stats.statistics import bounds_if_lost, reach_record


def site(name: str, reached: int, logs: int, lost: int) -> SiteFound:
    record = reach_record(reached, logs)
    shares = {key: record[key] for key in ("p", "ci_low", "ci_high")}
    bounds = bounds_if_lost(reached, logs, lost)
    return SiteFound(
        name, [SiteRow(name, "done", line_id="road", released=logs, n_reach=reached, **shares, **bounds)], logs=logs
    )


def test_lost_logs_are_reported_at_each_site_and_together():
    found = [site("A", 17, 60, 10), site("B", 0, 60, 0)]
    first, second = words_of_sites(found)
    assert "road: 28 % (19 to 41 %), 10 others left the terrain model before it: 45 % if all of them reach it" in first
    assert "others" not in second
    (total,) = reach_of_all(found)
    assert (total["n_reach"], total["n_total"], total["n_lost"], total["sites"]) == (17, 120, 10, 2)
    assert total["p_high_if_lost"] == pytest.approx(27 / 120)
    assert total["ci_high_if_lost"] == pytest.approx(reach_record(27, 120)["ci_high"])
