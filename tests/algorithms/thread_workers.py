"""Workers of a Dask scheduler as threads of the test: nothing is started, and what is patched holds on them, too."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

STARTED = 2  # workers, at most


@contextmanager
def threads_for_workers(distributed: Any, number: int) -> Iterator[tuple[str, None]]:
    """In the place of ``scheduler._local_cluster``."""
    with distributed.LocalCluster(
        n_workers=min(number, STARTED),
        threads_per_worker=2,
        processes=False,
        dashboard_address=None,
        worker_dashboard_address=None,
    ) as cluster:
        yield cluster.scheduler_address, None
