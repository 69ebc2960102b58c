"""The speed/accuracy study: slide, measure, and write the page, the figures and the short table.

python -m benchmarks                                   everything that the page needs (``plan``), as far as missing
python -m benchmarks --dry                             what is missing, and how long it would take
python -m benchmarks --only posture noise              only these parts of the plan and small studies
python -m benchmarks --minutes 30                      no new block after half an hour; run it again to continue
python -m benchmarks slide --scenes forest --settings draft standard reference --logs 40000
python -m benchmarks extras | peers                    the small studies again | other engines
python -m benchmarks same-bits --engine PATH           does this engine equal the other checkout's, bit for bit?
python -m benchmarks page                              page and figures from results.json
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from . import peers, plan, same_bits, scenes, study
from .settings import FACTORS, SETTINGS


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    jobs = ("all", "slide", "measure", "extras", "peers", "same-bits", "page")
    parser.add_argument("job", nargs="?", default="all", choices=jobs)
    parser.add_argument("--logs", type=int, default=400, help=f"slide: a scene and setting, in blocks of {study.BLOCK}")
    parser.add_argument("--scenes", nargs="+", default=list(scenes.CASES), choices=list(scenes.CASES))
    parser.add_argument("--settings", nargs="+", default=list(SETTINGS), choices=list(SETTINGS), metavar="SETTING")
    parser.add_argument("--factors", nargs="+", default=[], choices=list(FACTORS), help="all settings of these instead")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--minutes", type=float, default=1e6, help="start no new block after so long")
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help="all: parts of the plan, small studies")
    parser.add_argument("--engine", type=Path, metavar="PATH", help="same-bits: root of another checkout")
    parser.add_argument("--dry", action="store_true", help="all: only say what is missing and how long it takes")
    parser.add_argument("--no-page", action="store_true", help="slide only")
    ask = parser.parse_args()
    until = time.time() + 60.0 * ask.minutes
    settings = [s for s in SETTINGS.values() if (s.group in ask.factors if ask.factors else s.name in ask.settings)]
    if ask.job == "all":
        plan.whole(threads=ask.threads, until=until, only=ask.only, dry=ask.dry)
    if ask.job == "slide":
        study.run(ask.scenes, settings, ask.logs, threads=ask.threads, until=until)
    if ask.job in ("slide", "measure") and not ask.no_page:
        study.summarise(list(scenes.CASES), list(SETTINGS.values()), threads=ask.threads)
    if ask.job == "extras":
        plan.do_sections(list(plan.SECTIONS), threads=ask.threads)
    if ask.job == "same-bits":
        if ask.engine is None:
            parser.error("same-bits needs --engine PATH, the root of another checkout")
        if not same_bits.compare(ask.engine.resolve()):
            raise SystemExit(1)
    if ask.job == "peers":
        study.add_section("peers", peers.compare())
    if not ask.no_page and not ask.dry:
        from . import page  # imports matplotlib: only when something is drawn

        page.write()


if __name__ == "__main__":
    main()
