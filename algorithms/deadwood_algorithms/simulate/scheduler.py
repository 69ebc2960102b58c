"""The scheduler of ``--scheduler``: an existing one, or one with workers on this machine for the duration of the work.

With ``local``, the processes listen on the loopback only and require a certificate that is created for
this run and never leaves the memory of its processes: another user of the machine cannot connect.
"""

from __future__ import annotations

import logging
import os
import re
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, UserError

if TYPE_CHECKING:
    from deadwood_algorithms.simulate.workers import Workers

LOCAL = "local"
ADDRESS = re.compile(r"(tcp|tls)://(\[[0-9a-fA-F:]+\]|[^\s:/\[\]]+):\d{1,5}")
CONNECT_S = 10.0
MISSING = (
    "--scheduler needs Dask, which is not installed in this environment: pip install 'deadwood-toolbox[dask]', "
    "or pip install distributed cryptography"
)
_open: dict[tuple[str, int | None], Workers] = {}


def refuse_no_scheduler(scheduler: str | None, workers: int | None) -> None:
    """Raise ``UserError`` for an impossible address; whether a scheduler answers there is found by connecting."""
    if scheduler is None:
        if workers is not None:
            raise UserError("--workers needs --scheduler: local starts that number on this machine")
    elif scheduler != LOCAL and not ADDRESS.fullmatch(scheduler):
        raise UserError(
            f"--scheduler is '{scheduler}', but must be local or the address of a Dask scheduler, such as "
            "tcp://127.0.0.1:8786 (its first lines of output name it)"
        )


@contextmanager
def workers_of(scheduler: str | None, workers: int | None, cores: int, feedback: Feedback) -> Iterator[Workers | None]:
    """The requested workers, or None; inside another such block, those of that block.

    scheduler : None, ``local`` or an address; workers : how many are started, or waited for; cores : of this machine
    """
    refuse_no_scheduler(scheduler, workers)
    if scheduler is None:
        yield None
        return
    key = scheduler, workers
    if key in _open:
        yield _open[key]
        return
    with ExitStack() as stack:
        found = stack.enter_context(_connected(scheduler, workers or (cores if scheduler == LOCAL else 1), feedback))
        _open[key] = found
        try:
            yield found
        finally:
            del _open[key]
            say_carried(found, feedback)


@contextmanager
def _connected(scheduler: str, number: int, feedback: Feedback) -> Iterator[Workers]:
    try:
        import distributed
    except ImportError as error:
        raise UserError(MISSING) from error
    from deadwood_algorithms.simulate.workers import Workers

    with ExitStack() as stack:
        stack.enter_context(_quiet_logs())
        where, security = scheduler, None
        if scheduler == LOCAL:
            feedback.progress(0, 1, f"starting {counted(number, 'worker')}")
            where, security = stack.enter_context(_local_cluster(distributed, number))
        elif scheduler.startswith("tls:") and not distributed.Security().get_connection_args("client").get(
            "ssl_context"
        ):
            raise UserError(
                f"--scheduler {scheduler}: Dask's configuration names no certificate for it; write ca-file and client "
                "(cert, key) under distributed, comm, tls into ~/.config/dask/tls.yaml (docs/many-machines.md)"
            )
        try:
            client = distributed.Client(where, security=security, timeout=CONNECT_S, set_as_default=False)
        except (OSError, TimeoutError, ValueError, RuntimeError) as error:
            why = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise UserError(
                f"--scheduler {scheduler}: no scheduler answers there ({why}); start one with: dask scheduler"
            ) from error
        stack.callback(client.close, timeout=5)
        workers = Workers(client, scheduler, feedback, wanted=number)
        stack.callback(workers.close)
        yield workers


@contextmanager
def _local_cluster(distributed: Any, number: int) -> Iterator[tuple[str, Any]]:
    """The address of ``number`` processes of one thread each, and the certificate that they require.

    Processes, because the kernels release Python's lock, but the code around them does not.
    """
    import dask.config as dask_config

    try:
        security = distributed.Security.temporary()
    except ImportError as error:
        raise UserError(MISSING) from error
    _start_silent_tracker()
    # No web pages, and no profiling of threads (100 times a second) and event loops (50 times a second)
    lean = {f"distributed.{each}.http.routes": [] for each in ("scheduler", "worker", "nanny")}
    lean |= {"distributed.worker.profile.enabled": False, "distributed.admin.system-monitor.interval": "5s"}
    lean |= {"distributed.admin.tick.interval": "1s"}
    try:
        with dask_config.set(lean):
            cluster = distributed.LocalCluster(
                n_workers=number,
                threads_per_worker=1,
                processes=True,
                host="127.0.0.1",
                protocol="tls",
                security=security,
                dashboard_address=None,
                worker_dashboard_address=None,
                scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},  # without web pages, on any free port
                memory_limit=0,  # whether it fits is computed before the run
                silence_logs=logging.CRITICAL,
                # Ctrl-C is for the main process
                preload=["import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"],
            )
    except (OSError, RuntimeError, TimeoutError) as error:
        raise UserError(
            f"--scheduler local: the workers do not start ({(str(error).splitlines() or [''])[0]}); where a script of "
            'your own calls the tool, the call must stand under: if __name__ == "__main__":'
        ) from error
    try:
        yield cluster.scheduler_address, security
    finally:
        cluster.close(timeout=10)


def _start_silent_tracker() -> None:
    """Start Python's resource tracker such that it does not write to stderr after a Ctrl-C."""
    if os.name == "posix":
        from multiprocessing import resource_tracker

        sys.warnoptions.append("ignore")
        try:
            resource_tracker.ensure_running()
        finally:
            sys.warnoptions.remove("ignore")


@contextmanager
def _quiet_logs() -> Iterator[None]:
    """Silence Dask, which reports every worker that joins or leaves on stderr; the toolbox reports what matters."""
    loggers = [logging.getLogger(name) for name in ("distributed", "asyncio", "tornado")]
    before = [each.level for each in loggers]
    for each in loggers:
        each.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for each, level in zip(loggers, before, strict=True):
            each.setLevel(level)


def say_carried(workers: Workers, feedback: Feedback) -> None:
    """Report the network traffic, for planning."""
    carried = workers.carried
    if carried.logs:
        feedback.note(
            f"--scheduler: the network carried {carried.orders / carried.logs:.0f} bytes per log to the workers, "
            f"{carried.answers / carried.logs:.0f} back, and {carried.scenes / 1e6:.3g} MB of scenes in all"
        )
