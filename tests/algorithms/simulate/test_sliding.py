"""What several callers measure of the sliding at the same time."""

from __future__ import annotations

from deadwood_algorithms.simulate import sliding


def test_a_meter_ends_with_its_own_block_whichever_began_last():
    first, second = sliding.metered(), sliding.metered()
    one, other = first.__enter__(), second.__enter__()
    first.__exit__(None, None, None)
    assert sliding._meters == [other]
    assert one is not other
    second.__exit__(None, None, None)
    assert sliding._meters == []
