"""The page's server as a program: which requests are answered, what happens if the engine is lost, and how it ends."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
import websocket
from explore_case import CIRCLE, LOGS, write_case
from PIL import Image

from deadwood_algorithms.explore.frames import Frame

ROOT = Path(__file__).parents[3]
STARTED_S = 240.0  # the kernels may have to be compiled


def start(*arguments: str, **pipes: Any) -> subprocess.Popen[Any]:
    paths = os.pathsep.join(str(ROOT / each) for each in ("", "engine", "algorithms"))
    env = {**os.environ, "PYTHONPATH": paths}
    command = [sys.executable, "-m", "deadwood_toolbox", "explore", *arguments]
    return subprocess.Popen(command, env=env, stderr=subprocess.PIPE, stdout=subprocess.PIPE, **pipes)


def flags(layers: dict[str, str]) -> list[str]:
    return [part for name, path in layers.items() for part in ("--" + name.replace("_", "-"), path)]


@dataclass
class Page:
    """A running server, as seen by a client with its address."""

    process: subprocess.Popen[Any]
    base: str
    token: str

    @property
    def cookie(self) -> str:
        return f"deadwood_{self.base.rsplit(':', 1)[1]}={self.token}"

    def get(self, path: str, *, cookie: str | None = None, **headers: str) -> tuple[int, dict[str, str], bytes]:
        if cookie != "":
            headers["Cookie"] = cookie or self.cookie
        request = urllib.request.Request(self.base + path, headers=headers)
        try:
            with urllib.request.urlopen(request, timeout=30) as found:
                return found.status, dict(found.headers), found.read()
        except urllib.error.HTTPError as error:
            return error.code, dict(error.headers), error.read()

    @contextlib.contextmanager
    def socket(self) -> Iterator[Asker]:
        opened = websocket.create_connection(
            self.base.replace("http", "ws") + "/socket", cookie=self.cookie, origin=self.base, timeout=STARTED_S
        )
        try:
            yield Asker(opened)
        finally:
            opened.close()

    def engine(self) -> psutil.Process:
        (child,) = psutil.Process(self.process.pid).children()
        return child


@dataclass
class Asker:
    socket: Any

    def next(self) -> Frame:
        return Frame.unpacked(self.socket.recv())

    def ask(self, **message: Any) -> Frame:
        """The last frame of the answer."""
        self.socket.send(json.dumps(message))
        while not (frame := self.next()).facts.get("final", True):
            pass
        return frame

    def is_answered(self) -> bool:
        told = self.ask(op="release", id=77, shape=CIRCLE, n=10, logs=LOGS)
        return told.facts["op"] == "hits" and told.facts["done"] == 10


def opened_page(layers: dict[str, str], *more: str) -> Page:
    process = start(*flags(layers), "--no-browser", *more)
    assert process.stdout is not None
    line = process.stdout.readline().decode()
    if not line:
        pytest.fail(process.communicate()[1].decode())
    base, token = line.strip().split("/?token=")
    return Page(process, base, token)


@pytest.fixture(scope="module")
def layers(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    return write_case(tmp_path_factory.mktemp("served"))


@pytest.fixture(scope="module")
def page(layers: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    served = opened_page(layers, "--output", str(tmp_path_factory.mktemp("kept") / "runs"))
    yield served
    served.process.kill()
    served.process.communicate()


def test_it_listens_on_the_loopback_address_alone(page: Page):
    port = int(page.base.rsplit(":", 1)[1])
    listening = [each.laddr for each in psutil.Process(page.process.pid).net_connections() if each.status == "LISTEN"]
    assert [(each.ip, each.port) for each in listening] == [("127.0.0.1", port)]
    assert page.base == f"http://127.0.0.1:{port}"
    assert len(page.token) >= 32


@pytest.mark.parametrize("path", ["/", "/page/explore.js", "/tiles/0/0/0.png", "/socket", "/nothing"])
def test_without_the_token_nobody_is_answered(page: Page, path: str):
    for cookie in ("", "deadwood=1", page.cookie[:-1], page.cookie + "x", "other=" + page.token):
        status, _, body = page.get(path, cookie=cookie)
        assert (status, body) == (403, b"403\n")
    status, *_ = page.get(path + "?token=", cookie="")
    assert status == 403


@pytest.mark.parametrize("path", ["/", "/tiles/0/0/0.png", "/socket"])
def test_another_host_or_origin_is_refused(page: Page, path: str):
    port = page.base.rsplit(":", 1)[1]
    for host in ("example.org", f"example.org:{port}", "127.0.0.1", "127.0.0.1:1", f"127.0.0.1.nip.io:{port}"):
        assert page.get(path, Host=host)[0] == 403
    for origin in ("http://example.org", "null", f"https://127.0.0.1:{port}", "http://127.0.0.1:1"):
        assert page.get(path, Origin=origin)[0] == 403
    assert page.get("/tiles/0/0/0.png", Host=f"localhost:{port}", Origin=page.base)[0] == 200


def test_a_socket_from_elsewhere_is_refused(page: Page):
    address = page.base.replace("http", "ws") + "/socket"
    for more in ({"cookie": page.cookie, "origin": "http://example.org"}, {"origin": page.base}):
        with pytest.raises(websocket.WebSocketBadStatusException, match="403"):
            websocket.create_connection(address, timeout=10, **more)


def test_what_is_sent_may_come_from_here_alone_and_is_not_kept(page: Page):
    for path in ("/tiles/0/0/0.png", "/page/none.js", "/nothing"):
        _, headers, _ = page.get(path)
        policy = headers["Content-Security-Policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert "http" not in policy
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert headers["Referrer-Policy"] == "no-referrer"
        assert "Server" not in headers


@pytest.mark.parametrize(
    "path", ["/page/..%2fserver.py", "/page/../server.py", "/page/server.py", "/page/%2e%2e/session.py", "/page/a/b.js",
             "/tiles/0/9999/0.png", "/tiles/77/0/0.png", "/tiles/0/-1/0.png", "/tiles/0/0/0.png/x"],
)  # fmt: skip
def test_nothing_but_the_page_and_its_tiles_is_there(page: Page, path: str):
    assert page.get(path)[0] == 404


def test_the_tiles_are_pictures_of_the_terrain(page: Page):
    with page.socket() as asker:
        scene = asker.ask(op="open").facts
    assert (scene["rows"], scene["columns"], scene["levels"]) == (260, 180, 2)
    pictures = [page.get(f"/tiles/{tile}.png") for tile in ("0/0/0", "0/0/1", "1/0/0")]
    assert [status for status, *_ in pictures] == [200] * 3
    full, rest, half = (np.asarray(Image.open(BytesIO(body))) for *_, body in pictures)
    assert full.shape == (256, 256, 2)
    assert (full[:, :180, 1] > 0).mean() > 0.95
    assert not full[:, 180:, 1].any()
    assert rest[:4, :180, 1].any()
    assert not rest[4:, :, 1].any()
    assert half[:130, :90, 1].any()
    assert not half[130:, :, 1].any()


def test_the_scene_names_no_place_on_the_machine(page: Page, layers: dict[str, str]):
    with page.socket() as asker:
        for frame in (asker.ask(op="open"), asker.ask(op="release", shape=CIRCLE, n=5), asker.ask(op="keep", name="b")):
            told = json.dumps(frame.facts)
            assert str(Path(layers["dem"]).parent) not in told
            assert str(Path.home()) not in told
            assert "/" not in json.dumps(frame.facts.get("files", []))


def test_a_hundred_megabytes_are_refused_and_the_engine_lives(page: Page):
    engine = page.engine().pid
    large = b"x" * (100 << 20)
    host, port = page.base.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=30) as raw:
        head = (
            f"POST / HTTP/1.1\r\nHost: {host}:{port}\r\nCookie: {page.cookie}\r\nContent-Length: {len(large)}\r\n\r\n"
        )
        with contextlib.suppress(OSError):
            raw.sendall(head.encode() + large)
        answer = b""
        with contextlib.suppress(OSError):
            answer = raw.recv(100)
        assert not answer or answer.split()[1] in (b"400", b"405", b"413")
    with page.socket() as asker, contextlib.suppress(OSError, websocket.WebSocketException):
        asker.socket.send(large.decode())
        assert asker.socket.recv() == ""
    with socket.create_connection((host, int(port)), timeout=30) as raw, contextlib.suppress(OSError):
        raw.sendall(b"GET / HTTP/1.1\r\nX: " + large[: 1 << 20])
        assert raw.recv(100)[:12] in (b"", b"HTTP/1.1 431", b"HTTP/1.1 400")
    with page.socket() as asker:
        assert asker.is_answered()
    assert page.engine().pid == engine
    assert psutil.Process(page.process.pid).memory_info().rss < 300 << 20


def test_what_is_no_question_is_refused_in_words_and_the_engine_lives(page: Page):
    engine = page.engine().pid
    with page.socket() as asker:
        assert asker.is_answered()  # there are logs to keep
        for text, words in (
            ('{"op": "release", "id": 1, "shape": {"circle": [NaN, 1, 1]}}', "NaN is not a number"),
            ('{"op": "release", "id": 1, "shape": {"circle": [1e999, 1, 1]}}', "1e999 is not a number"),
            ("[1, 2]", "not a JSON object"),
            ("no json", "not JSON"),
            ("[" * 100_000, "not JSON"),
            ('{"op": "shutdown"}', "'op' must be"),
            ('{"op": "tile", "level": 1.5}', "whole numbers"),
            ('{"op": "keep", "name": "../up"}', "give the run a name"),
        ):
            asker.socket.send(text)
            told = asker.next().facts
            assert told["op"] == "refused"
            assert words in told["text"]
        asker.socket.send_binary(b"\xff\xfe\x00")
        assert asker.next().facts["op"] == "refused"
        assert asker.is_answered()
    assert page.engine().pid == engine


def test_a_page_opened_again_continues_and_the_former_is_reported(page: Page):
    with page.socket() as first:
        assert first.is_answered()
        with page.socket() as second:
            assert "elsewhere" in first.next().facts["text"]
            assert first.socket.recv() == ""
            assert second.next().facts["op"] == "took_over"
            assert second.ask(op="poses", max=3).facts["logs"] == 3  # the request is still there


def test_an_engine_killed_in_the_middle_of_an_answer_is_reported_and_started_again(page: Page):
    with page.socket() as asker:
        asker.socket.send(json.dumps({"op": "release", "id": 1, "shape": CIRCLE, "n": 5000, "fidelity": "reference"}))
        assert asker.next().facts["op"] == "hits"
        before = page.engine()
        before.kill()
        while (told := asker.next().facts)["op"] == "hits":
            assert not told["final"]
        assert told["op"] == "restarted"
        assert "started again" in told["text"]
        assert asker.is_answered()
        assert page.engine().pid != before.pid
        assert page.get("/tiles/0/0/0.png")[0] == 200


def test_it_ends_with_ctrl_c_and_leaves_no_engine(layers: dict[str, str]):
    served = opened_page(layers)
    engine = served.engine()
    with served.socket() as asker:
        asker.socket.send(json.dumps({"op": "release", "id": 1, "shape": CIRCLE, "n": 5000, "fidelity": "reference"}))
        asker.next()
        served.process.send_signal(signal.SIGINT)
        out, err = served.process.communicate(timeout=10)
    assert (served.process.returncode, out) == (0, b"")  # the one line has been read
    assert b"Traceback" not in err
    psutil.wait_procs([engine], timeout=5)
    assert not engine.is_running()


def test_an_engine_whose_server_is_killed_ends(layers: dict[str, str]):
    served = opened_page(layers)
    engine = served.engine()
    served.process.kill()
    served.process.communicate()
    gone, _ = psutil.wait_procs([engine], timeout=10)
    assert gone


def test_a_wrong_input_is_one_line_and_no_address(layers: dict[str, str], tmp_path: Path):
    for wrong, words in (
        ({**layers, "trees": str(tmp_path / "none.gpkg")}, "none.gpkg"),
        ({**layers, "friction": "-1"}, "--friction"),
    ):
        ran = start(*flags(wrong), "--no-browser")
        out, err = ran.communicate(timeout=STARTED_S)
        assert (ran.returncode, out) == (2, b"")
        assert words in err.decode().splitlines()[-1]
        assert b"Traceback" not in err


def test_a_port_that_is_taken_is_refused_at_once(layers: dict[str, str]):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        ran = start(*flags(layers), "--no-browser", "--port", str(taken.getsockname()[1]))
        out, err = ran.communicate(timeout=STARTED_S)
    assert (ran.returncode, out) == (2, b"")
    assert "choose another one" in err.decode()


class Pipes:
    """`explore --stdio`, as a program sees it."""

    def __init__(self, layers: dict[str, str]) -> None:
        self.process = start(*flags(layers), "--stdio", stdin=subprocess.PIPE)

    def tell(self, **message: Any) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(message).encode() + b"\n")
        self.process.stdin.flush()

    def next(self) -> Frame:
        assert self.process.stdout is not None
        length = int.from_bytes(self.process.stdout.read(4), "little")
        return Frame.unpacked(self.process.stdout.read(length))


def test_on_pipes_the_same_is_answered_and_its_end_is_the_end_of_its_input(layers: dict[str, str], page: Page):
    pipes = Pipes(layers)
    assert pipes.next().facts == {"op": "ready"}
    message = {"op": "release", "id": 4, "shape": CIRCLE, "n": 40, "logs": LOGS}
    pipes.tell(**message)
    first, last = pipes.next(), pipes.next()
    assert (first.facts["done"], last.facts["done"]) == (30, 40)
    with page.socket() as asker:
        asker.ask(op="edit")
        same = asker.ask(**message)
    assert {**last.facts, "ms": 0} == {**same.facts, "ms": 0}
    assert all(np.array_equal(each, same.arrays[name]) for name, each in last.arrays.items())
    pipes.tell(op="tile", id=9, level=0, column=0, row=0)
    assert pipes.next().arrays["png"].tobytes() == page.get("/tiles/0/0/0.png")[2]
    pipes.tell(op="release", id=5, shape=CIRCLE, n=5000, fidelity="reference")
    pipes.next()
    assert pipes.process.stdin is not None
    began = time.monotonic()
    pipes.process.stdin.close()
    pipes.process.stdin = None
    _, err = pipes.process.communicate(timeout=20)
    assert pipes.process.returncode == 0
    assert time.monotonic() - began < 6.0
    assert b"Traceback" not in err


def test_while_the_mouse_moves_each_question_is_answered_and_none_waits(layers: dict[str, str]):
    """A newer request replaces one that has not begun; the last is answered completely."""
    pipes = Pipes(layers)
    pipes.next()
    for k in range(40):
        pipes.tell(op="release", id=k, shape={"circle": [60.0 + k, 190.0, 5.0]}, n=300, logs=LOGS)
        time.sleep(0.02)
    frames = []
    while not (frames and frames[-1]["id"] == 39 and frames[-1]["final"]):
        frames.append(pipes.next().facts)
    ids = [frame["id"] for frame in frames]
    assert ids == sorted(ids)
    assert len(set(ids)) > 2
    assert all(
        frame["done"] == 30 for frame, before in zip(frames, [None, *ids], strict=False) if frame["id"] != before
    )
    assert pipes.process.stdin is not None
    pipes.process.stdin.close()
    pipes.process.stdin = None
    pipes.process.communicate(timeout=20)


def test_from_a_notebook_whose_cells_run_within_a_loop(layers: dict[str, str], tmp_path: Path):
    """Its interrupt ends the cell and the engine."""
    cell = (
        "import asyncio, signal, sys\n"
        # a test run that a shell started in the background has inherited that the signal is ignored
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from deadwood_algorithms.tools import explore\n"
        "async def cell():\n"
        f"    explore.TOOL(dem={layers['dem']!r}, output={str(tmp_path)!r}, no_browser=True)\n"
        "try:\n"
        "    asyncio.new_event_loop().run_until_complete(cell())\n"  # as a notebook: an interrupt is an exception
        "except KeyboardInterrupt:\n"
        "    sys.exit(7)\n"
    )
    paths = os.pathsep.join(str(ROOT / each) for each in ("", "engine", "algorithms"))
    ran = subprocess.Popen(
        [sys.executable, "-c", cell],
        env={**os.environ, "PYTHONPATH": paths},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert ran.stdout is not None
    base, token = ran.stdout.readline().decode().strip().split("/?token=")
    page = Page(ran, base, token)
    engine = page.engine()
    with page.socket() as asker:
        assert asker.is_answered()
    ran.send_signal(signal.SIGINT)
    _, err = ran.communicate(timeout=20)
    assert (ran.returncode, err) == (7, b"")
    psutil.wait_procs([engine], timeout=5)
    assert not engine.is_running()
