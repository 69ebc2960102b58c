"""Run by QGIS's own Python: the toolbox's own environment made, broken, repaired, cancelled and removed by the plugin.

The wheel is a small one of the same name, with a command that answers like the toolbox's; pip and venv are real.
Prints one JSON object: the result of each case.
"""

from __future__ import annotations

import json
import os
import socket
import sys
import time
from pathlib import Path
from typing import Any

from qgis.core import QgsApplication, QgsNetworkAccessManager, QgsSettings

WORK, PLUGINS, WHEELS = (Path(each) for each in sys.argv[1:4])
application = QgsApplication([], False)
application.initQgis()
sys.path.insert(0, str(PLUGINS))
from deadwood import finding, own_python  # noqa: E402
from deadwood.environment_setup import Setup  # noqa: E402

LIMIT_S = 120.0
GOOD, BAD, SLOW = (str(next((WHEELS / name).glob("*.whl"))) for name in ("good", "bad", "slow"))
outcomes: dict[str, Any] = {}


def case(name: str, do: Any, *, cancel_at: str = "") -> None:
    """One action of the user, to its end; QGIS's own events continue meanwhile."""
    setup = Setup()
    ended: list[Any] = []
    seen: list[tuple[int, str]] = []
    longest, last = 0.0, time.monotonic()
    setup.ended.connect(lambda worked, message: ended.extend([worked, message, setup.busy()]))
    setup.moved.connect(lambda percent, what: seen.append((percent, what)))
    do(setup)
    until = time.monotonic() + LIMIT_S
    while not ended or setup.busy():
        application.processEvents()
        now = time.monotonic()
        longest, last = max(longest, now - last), now
        if cancel_at and any(cancel_at in what for _, what in seen):
            setup.cancel()
        assert now < until, (name, seen)
        time.sleep(0.005)
    found = finding.find()
    outcomes[name] = {
        "worked": ended[0],
        "message": ended[1],
        "busy_at_its_end": ended[2],
        "percents": [percent for percent, _ in seen],
        "blocked_s": longest,
        "left": sorted(each.name for each in setup.place.parent.glob("deadwood-toolbox*")),
        "found": getattr(found, "how", ""),
        "command": list(getattr(found, "command", ())),
    }


def refused(name: str, source: str, *, python: str = "", **variables: str) -> None:
    """A start in an environment in which it must fail."""
    before = dict(os.environ)
    os.environ.update(variables)
    try:
        case(name, lambda setup: setup.make(python, source))
    finally:
        os.environ.clear()
        os.environ.update(before)


old = WORK / "old_python"
old.write_text("#!/bin/sh\nprintf '3\\n9\\n18\\n/usr/bin/python3.9\\n'\n", encoding="utf-8")
bare = WORK / "bare_python"
says = f'printf "3\\n12\\n1\\n{bare}\\n"'
bare.write_text(
    f'#!/bin/sh\ncase "$*" in *venv*) echo "ensurepip is not available"; exit 1;; *) {says};; esac\n', encoding="utf-8"
)
crooked = WORK / "crooked_python"  # makes an environment whose Python does not start
made = 'mkdir -p "$place/bin"; printf "#!/bin/sh\\necho broken bundle; exit 1\\n" > "$place/bin/python"'
says = f'printf "3\\n12\\n1\\n{crooked}\\n"'
crooked.write_text(
    f'#!/bin/sh\nfor place in "$@"; do :; done\ncase "$*" in *venv*) echo "$PIP_PROXY" > {WORK}/proxy; {made}; '
    f'chmod +x "$place/bin/python";; *) {says};; esac\n',
    encoding="utf-8",
)
for each in (old, bare, crooked):
    each.chmod(0o755)

refused("no_python", GOOD, python=str(old))
refused("no_venv", GOOD, python=str(bare))
listed = [str(old), str(bare), str(crooked)]
real, own_python.candidates = own_python.candidates, lambda named="": listed
for key, value in (
    ("Type", "HttpProxy"),
    ("Host", "proxy.office"),
    ("Port", "3128"),
    ("User", "a b"),
    ("Password", "p"),
):
    QgsSettings().setValue(f"proxy/proxy{key}", value)
QgsSettings().setValue("proxy/proxyEnabled", True)
QgsNetworkAccessManager.instance().setupDefaultProxyAndCache()
refused("none_works", GOOD)
outcomes["none_works"]["proxy"] = (WORK / "proxy").read_text(encoding="utf-8").strip()
QgsSettings().setValue("proxy/proxyEnabled", False)
QgsNetworkAccessManager.instance().setupDefaultProxyAndCache()
listed.append(sys.executable)
case("the_next_one_works", lambda setup: setup.make("", GOOD))
case("removed_again", lambda setup: setup.remove())
own_python.candidates = real
with socket.create_server(("localhost", 0)) as taken:
    closed = f"http://localhost:{taken.getsockname()[1]}"  # nothing listens there any more
refused("no_network", "", PIP_INDEX_URL=closed, PIP_RETRIES="1", PIP_NO_INDEX="0")
refused("not_in_the_index", "", PIP_NO_INDEX="1")
case("cancelled_while_installing", lambda setup: setup.make("", GOOD), cancel_at="Installing")
case("made", lambda setup: setup.make("", GOOD))
case("cancelled_repair", lambda setup: setup.make("", SLOW), cancel_at="Compiling")
case("broken_repair", lambda setup: setup.make("", BAD))
(finding.script_in(finding.own_folder())).unlink()
case("repaired", lambda setup: setup.make("", GOOD))
case("removed", lambda setup: setup.remove())
print("JSON" + json.dumps(outcomes), flush=True)
os._exit(0)
