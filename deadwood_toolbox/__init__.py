"""The Deadwood Toolbox from Python: each tool is a function.

    import deadwood_toolbox as dw

    sample = dw.sample_data()
    releases = dw.sample_releases(areas=sample.release_area, dem=sample.dem, count=20)
    run = dw.slide_logs(dem=sample.dem, releases=releases, trees=sample.trees, friction=0.25)
    run.deposits, run.hits, run.summary, run.report(), run.plot()

Nothing is loaded before it is used: the import itself takes no time.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from deadwood_algorithms.files.in_memory import Raster as Raster
    from deadwood_algorithms.params.tool import UserError as UserError
    from deadwood_toolbox.functions import *  # noqa: F403 (its __all__ says which)
    from deadwood_toolbox.result import Result as Result
    from deadwood_toolbox.sample import events as events
    from deadwood_toolbox.sample import sample_data as sample_data

    __version__: str

_ELSEWHERE = {
    "Raster": "deadwood_algorithms.files.in_memory",
    "UserError": "deadwood_algorithms.params.tool",
    "Result": "deadwood_toolbox.result",
    "events": "deadwood_toolbox.sample",
    "sample_data": "deadwood_toolbox.sample",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("deadwood_algorithms.params.tool").VERSION
    if name not in _ELSEWHERE and name not in _of_tools():  # modules of this package are also requested here first
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(_ELSEWHERE.get(name, f"{__name__}.functions")), name)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_ELSEWHERE, *_of_tools(), "__version__"})


def _of_tools() -> dict[str, str]:
    return import_module(f"{__name__}.shelf").PYTHON_NAMES
