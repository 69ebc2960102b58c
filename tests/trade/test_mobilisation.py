"""The measured skill of assess-mobilisation: the page is that of the file, and its figures are counted by hand."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest
from scipy.stats import spearmanr

from benchmarks import mobilisation

KNOWN = json.loads(mobilisation.MEASURED.read_text(encoding="utf-8"))


def test_the_page_is_that_of_the_file():
    assert f"<!-- skill -->\n{mobilisation.table(KNOWN)}\n<!-- end of skill -->" in mobilisation.PAGE.read_text("utf-8")


def test_every_case_was_measured():
    names = {f"{s} {c} {p}" for s in mobilisation.SLOPES for c in mobilisation.COVERS for p in mobilisation.POSTURES}
    assert set(KNOWN["cases"]) == names
    assert all(len(each) == mobilisation.LOGS for case in KNOWN["cases"].values() for each in case.values())


def test_the_figures_of_all_logs_by_pandas():
    logs = pd.concat([pd.DataFrame(case) for case in KNOWN["cases"].values()])
    cells = [each.strip() for each in mobilisation.table(KNOWN).splitlines()[-1].strip("|").split("|")]
    far = logs["runout_m"] > 100
    assert cells[1] == f"{100 * far.mean():.0f}"
    assert cells[3] == f"{spearmanr(logs['share_permille'], logs['runout_m'])[0]:.2f}"
    assert cells[4].startswith(f"{100 * logs.loc[far, 'inside'].mean():.0f} (")
    assert cells[5] == f"{100 * logs['inside'].mean():.0f}"
    assert cells[6] == f"{spearmanr(logs['before_permille'], logs['runout_m'])[0]:.2f}"
    assert cells[7].startswith(f"{100 * (logs.loc[far, 'before_permille'] >= 300).mean():.0f} (")


def test_ranks_with_ties_are_scipys():
    one, other = np.array([3.0, 1.0, 1.0, 7.0, 2.0, 7.0]), np.array([1.0, 0.0, 2.0, 2.0, 2.0, 9.0])
    assert mobilisation.rank_correlation(one, other) == pytest.approx(spearmanr(one, other)[0])
    assert np.isnan(mobilisation.rank_correlation(one, np.ones(6)))


def test_the_product_before_by_hand():
    """On a plane of 40 degrees without relief only friction counts; 30 degrees are too flat for it."""
    rise = (np.arange(40) + 0.5)[:, None] * np.ones(30)
    for degrees, expected in ((40.0, 1.0 - 0.25 / np.tan(np.radians(40.0))), (30.0, 0.0)):
        heights = np.tan(np.radians(degrees)) * rise
        assert mobilisation.product_before(heights, np.array([15.2]), np.array([20.7])) == pytest.approx(
            expected, abs=1e-9
        )
