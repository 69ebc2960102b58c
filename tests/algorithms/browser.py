"""A real Chromium without a window, driven over its DevTools protocol: what a reader of a page sees, clicks and prints.

Chromium comes from the system (Debian's package ``chromium``), WebGL runs in software; what it prints is looked at with
Poppler (``poppler-utils``). Where one is missing, tests are skipped, unless the environment variable
``DEADWOOD_CHROMIUM=required`` says that both must be there.
"""

from __future__ import annotations

import base64
import importlib.util
import itertools
import json
import os
import shutil
import subprocess
import tempfile
import time
from importlib import resources
from pathlib import Path
from typing import Any

import pytest

FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--no-first-run", "--disable-background-networking", "--disable-component-update",
    "--disable-sync", "--disable-dev-shm-usage", "--hide-scrollbars", "--remote-debugging-port=0",
    "--remote-allow-origins=*",
)  # fmt: skip
PATIENCE_S = 90.0


def chromium() -> str:
    return program("chromium", "chromium-browser", "google-chrome")


def program(*names: str) -> str:
    """The first of these programs that there is; without any the test is skipped, or fails where they are required."""
    found = next(filter(None, map(shutil.which, names)), None)
    if not found:
        missing = f"there is no {names[0]}"
        assert os.environ.get("DEADWOOD_CHROMIUM") != "required", f"DEADWOOD_CHROMIUM=required, but {missing}"
        pytest.skip(missing)
    return found


def axe() -> str:
    """axe-core as a script: from axe-playwright-python, which is newer, where somebody has it; else axe-core-python."""
    names = filter(importlib.util.find_spec, ("axe_playwright_python", "axe_core_python"))
    package = next(names, None)
    if package is None:
        assert os.environ.get("DEADWOOD_CHROMIUM") != "required", "DEADWOOD_CHROMIUM=required, but there is no axe-core"
        pytest.skip("there is no axe-core")
    return resources.files(package).joinpath("axe.min.js").read_text(encoding="utf-8")


class Browser:
    """One page in a browser of its own; remembers every request and whatever the console was told."""

    def __init__(self) -> None:
        import websocket

        self._home = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        with Path(os.devnull).open("w") as nothing:
            self._process = subprocess.Popen(
                [chromium(), *FLAGS, f"--user-data-dir={self._home.name}", "about:blank"],
                stdout=nothing,
                stderr=nothing,
            )
        port = Path(self._home.name) / "DevToolsActivePort"
        give_up = time.monotonic() + PATIENCE_S
        while not (port.is_file() and len(port.read_text().split()) == 2):
            assert time.monotonic() < give_up, "chromium did not start"
            time.sleep(0.1)
        number, path = port.read_text().split()
        self._socket = websocket.create_connection(f"ws://127.0.0.1:{number}{path}", timeout=PATIENCE_S)
        self._numbers = itertools.count(1)
        self._session: str | None = None
        self.requests: list[str] = []
        self.complaints: list[str] = []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **given: Any) -> dict[str, Any]:
        number = next(self._numbers)
        message: dict[str, Any] = {"id": number, "method": method, "params": given}
        if self._session:
            message["sessionId"] = self._session
        self._socket.send(json.dumps(message))
        while True:
            said = json.loads(self._socket.recv())
            self._remember(said)
            if said.get("id") == number:
                assert "error" not in said, f"{method}: {said['error']}"
                return said["result"]

    def _remember(self, said: dict[str, Any]) -> None:
        method, facts = said.get("method"), said.get("params", {})
        if method == "Network.requestWillBeSent":
            self.requests.append(facts["request"]["url"])
        elif method == "Runtime.exceptionThrown":
            self.complaints.append(json.dumps(facts["exceptionDetails"])[:500])
        elif method == "Runtime.consoleAPICalled" and facts["type"] in ("error", "warning", "assert"):
            self.complaints.append(json.dumps(facts["args"])[:500])
        elif method == "Log.entryAdded" and facts["entry"]["level"] in ("error", "warning"):
            self.complaints.append(facts["entry"]["text"])

    def size(self, width: int, height: int, *, phone: bool = False) -> None:
        scale = 2 if phone else 1
        self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=phone
        )

    def dark(self, on: bool = True) -> None:
        features = [{"name": "prefers-color-scheme", "value": "dark" if on else "light"}]
        self.call("Emulation.setEmulatedMedia", features=features)

    def open(self, page: Path | str) -> None:
        """A file, or an address."""
        self.call("Page.navigate", url=page if isinstance(page, str) else page.resolve().as_uri())
        self.wait("document.readyState === 'complete'")

    def ask(self, script: str) -> Any:
        """The value of an expression in the page; a promise is waited for."""
        told = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in told, told["exceptionDetails"]
        return told["result"].get("value")

    def wait(self, condition: str) -> None:
        give_up = time.monotonic() + PATIENCE_S
        while not self.ask(condition):
            assert time.monotonic() < give_up, f"in vain for {condition}"
            time.sleep(0.1)

    def mouse(self, kind: str, x: float, y: float, *, count: int = 1, down: bool = True) -> None:
        """What a mouse does: ``Pressed``, ``Moved`` or ``Released``."""
        self.call(
            "Input.dispatchMouseEvent",
            type=f"mouse{kind}",
            x=x,
            y=y,
            button="left" if down else "none",
            buttons=int(down and kind != "Released"),
            clickCount=count,
        )

    def click(self, x: float, y: float, *, count: int = 1) -> None:
        for kind in ("Pressed", "Released"):
            self.mouse(kind, x, y, count=count)

    def drag(self, start: tuple[float, float], end: tuple[float, float], steps: int = 8, wait_s: float = 0.03) -> None:
        self.mouse("Pressed", *start)
        for k in range(1, steps + 1):
            self.mouse("Moved", *(a + (b - a) * k / steps for a, b in zip(start, end, strict=True)))
            time.sleep(wait_s)
        self.mouse("Released", *end)

    def key(self, key: str, *, control: bool = False, shift: bool = False) -> None:
        """Press a key by its name (``Enter``) or sign."""
        codes = {"Enter": 13, "Escape": 27, "Tab": 9, "ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40}
        told: dict[str, Any] = {"key": key, "modifiers": 2 * control + 8 * shift}
        told["windowsVirtualKeyCode"] = codes.get(key, ord(key[0].upper()))
        text = "\r" if key == "Enter" else key
        typed = {"text": text} if len(text) == 1 and not control else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", **told, **typed)
        self.call("Input.dispatchKeyEvent", type="keyUp", **told)

    def picture(self, path: Path | None = None, *, whole: bool = False) -> bytes:
        taken = base64.b64decode(self.call("Page.captureScreenshot", captureBeyondViewport=whole)["data"])
        if path:
            path.write_bytes(taken)
        return taken

    def hard_to_use(self) -> list[str]:
        """What axe finds on the page that is serious or critical: rule and place."""
        if not self.ask("'axe' in window"):
            self.call("Runtime.evaluate", expression=axe())
        found = self.ask("axe.run(document, {resultTypes: ['violations']}).then((told) => told.violations)")
        return [
            f"{each['id']}: {' '.join(map(str, node['target']))}"
            for each in found
            if each["impact"] in ("serious", "critical")
            for node in each["nodes"]
        ]

    def printed(self) -> bytes:
        told = self.call("Page.printToPDF", printBackground=True, preferCSSPageSize=True)
        return base64.b64decode(told["data"])

    def close(self) -> None:
        self._socket.close()
        self._process.terminate()
        self._process.wait(timeout=30)
        self._home.cleanup()
