"""The speed/accuracy study: slide, measure, and write the page, the figures and the README's table.

python -m benchmarks                                   all scenes and settings, 400 logs each
python -m benchmarks slide --logs 4000 --minutes 30    go on from there, for half an hour
python -m benchmarks slide --scenes forest --settings draft standard reference --logs 16000
python -m benchmarks extras | peers                    short restarts and switches | other engines
python -m benchmarks page                              page and figures anew from results.json
"""

from __future__ import annotations

import argparse
import time

from . import extras, peers, scenes, study
from .settings import FACTORS, SETTINGS


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("job", nargs="?", default="slide", choices=("slide", "measure", "extras", "peers", "page"))
    parser.add_argument("--logs", type=int, default=400, help=f"logs a scene and setting, in blocks of {study.BLOCK}")
    parser.add_argument("--scenes", nargs="+", default=list(scenes.CASES), choices=list(scenes.CASES))
    parser.add_argument("--settings", nargs="+", default=list(SETTINGS), choices=list(SETTINGS), metavar="SETTING")
    parser.add_argument("--factors", nargs="+", default=[], choices=list(FACTORS), help="all settings of these instead")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--minutes", type=float, default=1e6, help="start no new block after so long")
    parser.add_argument("--no-page", action="store_true", help="slide only")
    ask = parser.parse_args()
    settings = [s for s in SETTINGS.values() if (s.group in ask.factors if ask.factors else s.name in ask.settings)]
    if ask.job == "slide":
        study.run(ask.scenes, settings, ask.logs, threads=ask.threads, until=time.time() + 60.0 * ask.minutes)
    if ask.job in ("slide", "measure") and not ask.no_page:
        study.summarise(list(scenes.CASES), list(SETTINGS.values()))
    if ask.job == "extras":
        study.add_section("restarts", extras.all_restarts(threads=ask.threads))
        study.add_section("crawls", extras.crawls(threads=ask.threads))
        study.add_section("plane", {"rows": extras.on_the_plane(threads=ask.threads)})
        study.add_section("rings", {"rows": extras.rings(threads=ask.threads)})
        study.add_section("speed", {"rows": extras.speed(threads=ask.threads)})
        study.add_section("switches", {"rows": extras.switches(threads=ask.threads)})
    if ask.job == "peers":
        study.add_section("peers", peers.compare())
    if not ask.no_page:
        from . import page  # matplotlib: only when something is drawn

        page.write()


if __name__ == "__main__":
    main()
