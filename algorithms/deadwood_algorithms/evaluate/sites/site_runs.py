"""One site of many: its position among the others, and its run or the reason why there is none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from deadwood_algorithms.evaluate.sites.overview import SiteFound, found_of_failure, found_of_run
from deadwood_algorithms.evaluate.sites.sites_table import SiteOptions
from deadwood_algorithms.params.tool import Cancelled, Feedback, Stage, UserError
from deadwood_algorithms.simulate.crew import NobodySlides


def site_stage(feedback: Feedback, name: str, number: int, count: int) -> Stage:
    """Feedback in which each message names the site."""
    return Stage(feedback, name, place=f"{name} ({number} of {count})")


def found_of_site(
    site: SiteOptions, values: dict[str, Any], place: Path, slide: Callable[[], None], feedback: Feedback
) -> SiteFound:
    """The results of a site's run, or its failure in one line, which does not stop the other sites.

    slide : makes the run in the folder ``place``, unless it exists there unchanged
    """
    try:
        if site.fault:
            raise UserError(site.fault)
        slide()
        return found_of_run(site.name, place)
    except (Cancelled, KeyboardInterrupt, NobodySlides):
        raise
    except UserError as error:
        message = str(error)
    except Exception as error:
        first = str(error).splitlines()[0] if str(error) else "no message"
        message = f"a bug in the toolbox, please report it: {type(error).__name__}: {first}"
    feedback.warn(message, code="site-failed")
    return found_of_failure(site.name, message, values)
