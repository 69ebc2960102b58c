"""The page's server: on the loopback address only, for clients that have its token, with one engine process behind it.

This process holds no scene and does not import the engine, so it always answers the page. It passes
messages on to a process served by `stdio`, and its frames back. If that process is lost, the page is notified, and
another one is started.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import json
import os
import queue
import secrets
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from typing import IO, Any

import tornado.httpserver
import tornado.netutil
import tornado.web
import tornado.websocket

from deadwood_algorithms.explore import web_page
from deadwood_algorithms.explore.frames import MOST_MESSAGE, Frame, header_of, message_of, refusal
from deadwood_algorithms.params.tool import Cancelled, Feedback, UserError

HOST = "127.0.0.1"
MOST_UNSENT = 64 << 20  # bytes that may wait for a page that does not read
OPENED_ELSEWHERE = 4001  # closing code of a socket: that page must not reconnect by itself
TILE_S = 30.0
END_S = 0.3  # the command itself has little more than half a second to end in its own order
MOST_LOST, LOST_S = 3, 60.0  # if so many engine processes are lost within this time, no further one is started
ENGINE_LOST = "the engine process was lost and has been started again; the last request is being repeated"
ENGINE_GONE = "the engine process keeps failing and is not started again; see the terminal"


class EngineProcess:
    """A child process that answers on pipes. ``heard`` is called with every frame, ``ended`` at the end,
    both on a separate thread.
    """

    def __init__(
        self, command: Sequence[str], first: str, heard: Callable[[Any, bytes], None], ended: Callable[[], None]
    ) -> None:
        apart: dict[str, Any] = {"start_new_session": True}  # a Ctrl-C in the terminal is handled by this process
        if sys.platform == "win32":
            apart = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
        here = {**os.environ, "PYTHONPATH": os.pathsep.join(each for each in sys.path if each)}
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=here, **apart)
        self.heard, self.ended = heard, ended
        self.lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self.tell(first)
        for work in (self._write, self._read):
            threading.Thread(target=work, name="engine pipes", daemon=True).start()

    def tell(self, line: str) -> None:
        self.lines.put(line)

    def end(self) -> None:
        """Close its input, which ends it; if it does not end, it is killed."""
        self.lines.put(None)
        try:
            self.process.wait(END_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def _write(self) -> None:
        assert self.process.stdin is not None
        with contextlib.suppress(OSError), self.process.stdin as stream:
            while (line := self.lines.get()) is not None:
                stream.write(line.encode() + b"\n")
                stream.flush()

    def _read(self) -> None:
        assert self.process.stdout is not None
        with contextlib.suppress(OSError, ValueError):
            while block := read_frame(self.process.stdout):
                self.heard(header_of(block)[0], block)
        self.end()
        self.ended()


def read_frame(stream: IO[bytes]) -> bytes:
    """The next frame; None at the end, also if that comes in the middle of a frame."""
    length = int.from_bytes(stream.read(4), "little")
    block = stream.read(length)
    return block if len(block) == length else b""


@dataclass
class Desk:
    """What the page's handlers share: who may ask, the engine, and the page that is open."""

    command: Sequence[str]
    first: str
    feedback: Feedback
    loop: asyncio.AbstractEventLoop
    token: str = field(default_factory=lambda: secrets.token_urlsafe(24))
    port: int = 0
    engine: EngineProcess | None = None
    page: Socket | None = None
    ready: asyncio.Event = field(default_factory=asyncio.Event)
    unfit: str | None = None
    closing: bool = False
    lost: list[float] = field(default_factory=list)
    tiles: dict[int, asyncio.Future[bytes]] = field(default_factory=dict)
    asked: int = 0

    @property
    def hosts(self) -> tuple[str, ...]:
        return f"{HOST}:{self.port}", f"localhost:{self.port}"

    @property
    def address(self) -> str:
        return f"http://{HOST}:{self.port}/?token={self.token}"

    @property
    def cookie(self) -> str:
        """Cookies do not distinguish ports: that of another server on this machine has another name."""
        return f"deadwood_{self.port}"

    def start(self) -> None:
        """Start the engine; its messages are handled on the loop."""
        self.ready.clear()
        mine: list[EngineProcess] = []

        def on_loop(work: Callable[..., None], *args: Any) -> None:
            with contextlib.suppress(RuntimeError):  # the loop has ended
                self.loop.call_soon_threadsafe(work, *args)

        mine.append(
            EngineProcess(
                self.command,
                self.first,
                lambda header, block: on_loop(self.heard, header, block),
                lambda: on_loop(self.engine_ended, mine),
            )
        )
        self.engine = mine[0]

    def heard(self, header: dict[str, Any], block: bytes) -> None:
        name = header.get("op")
        if name == "said":
            said_again(self.feedback, header)
        elif name == "unfit":
            self.unfit = str(header.get("text"))
        elif name == "ready":
            self.ready.set()
        elif header.get("id") in self.tiles and name in ("tile", "refused"):
            waiting = self.tiles.pop(header["id"])
            if not waiting.done():
                waiting.set_result(Frame.unpacked(block).arrays["png"].tobytes() if name == "tile" else b"")
        elif self.page:
            self.page.show(header, block)

    def engine_ended(self, which: list[EngineProcess]) -> None:
        if self.closing or which[0] is not self.engine:
            return
        started, self.engine = self.ready.is_set(), None
        for waiting in self.tiles.values():
            waiting.cancel()
        self.tiles.clear()
        if not started:
            self.ready.set()  # a waiting caller then checks
            return
        now = time.monotonic()
        self.lost = [each for each in self.lost if now - each < LOST_S] + [now]
        if len(self.lost) > MOST_LOST:
            self.feedback.warn(ENGINE_GONE)
            self.tell_page(refusal(ENGINE_GONE))
            return
        self.feedback.warn(ENGINE_LOST)
        self.start()
        self.tell_page(Frame({"op": "restarted", "text": ENGINE_LOST}))

    def tell_page(self, frame: Frame) -> None:
        if self.page:
            self.page.show(dict(frame.facts), frame.packed())

    async def tile(self, level: int, column: int, row: int) -> bytes:
        """A tile of the relief; empty if there is none."""
        if self.engine is None:
            return b""
        self.asked += 1
        number = -self.asked  # a number that the page never uses
        waiting = self.tiles[number] = self.loop.create_future()
        self.engine.tell(json.dumps({"op": "tile", "id": number, "level": level, "column": column, "row": row}))
        try:
            return await asyncio.wait_for(waiting, TILE_S)
        except (TimeoutError, asyncio.CancelledError):
            return b""
        finally:
            self.tiles.pop(number, None)


def said_again(feedback: Feedback, header: dict[str, Any]) -> None:
    """Repeat a message of the engine process as one of this process."""
    if header.get("how") == "progress":
        feedback.progress(header["done"], header["total"], header["text"])
    elif header.get("how") == "warn":
        feedback.warn(header["text"])
    else:
        feedback.note(header["text"])


class Guarded(tornado.web.RequestHandler):
    """Rejects requests under another host name (a page elsewhere whose name resolves to here) or without the token."""

    @property
    def desk(self) -> Desk:
        return self.settings["desk"]

    def set_default_headers(self) -> None:
        """Headers of every response, including errors."""
        self.clear_header("Server")
        for name, value in headers_of(self.desk).items():
            self.set_header(name, value)

    def prepare(self) -> None:
        desk, request = self.desk, self.request
        origin = request.headers.get("Origin")
        if request.host not in desk.hosts or (origin and origin not in [f"http://{each}" for each in desk.hosts]):
            raise tornado.web.HTTPError(403)
        given = self.get_query_argument("token", "") or self.get_cookie(desk.cookie) or ""
        if not hmac.compare_digest(given.encode(), desk.token.encode()):
            raise tornado.web.HTTPError(403)

    def write_error(self, status_code: int, **_: Any) -> None:
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"{status_code}\n")


def headers_of(desk: Desk) -> dict[str, str]:
    """Headers that forbid foreign content, framing by another page, and caching."""
    sockets = " ".join(f"ws://{each}" for each in desk.hosts)
    return {
        "Content-Security-Policy": (
            "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
            f"connect-src 'self' {sockets}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        ),
        "Cross-Origin-Opener-Policy": "same-origin",
        "Cross-Origin-Resource-Policy": "same-origin",
        "Referrer-Policy": "no-referrer",
        "X-Content-Type-Options": "nosniff",
        "Cache-Control": "no-store",
    }


class Missing(Guarded):
    def prepare(self) -> None:
        super().prepare()
        raise tornado.web.HTTPError(404)


class PageFile(Guarded):
    def get(self, name: str = "index.html") -> None:
        kind, content = web_page.files().get(name, ("", b""))
        if not kind:
            raise tornado.web.HTTPError(404)
        self.set_cookie(self.desk.cookie, self.desk.token, httponly=True, samesite="Strict")
        self.set_header("Content-Type", kind)
        self.finish(content)


class TileFile(Guarded):
    async def get(self, level: str, column: str, row: str) -> None:
        picture = await self.desk.tile(int(level), int(column), int(row))
        if not picture:
            raise tornado.web.HTTPError(404)
        self.set_header("Content-Type", "image/png")
        self.set_header("Cache-Control", "private, max-age=3600")
        self.finish(picture)


class Socket(Guarded, tornado.websocket.WebSocketHandler):
    """The page's socket. There is only one session, so only one page: opening another one is announced in the first."""

    unsent = 0

    def check_origin(self, origin: str) -> bool:
        return True  # ``prepare`` has checked it

    def open(self, *_: str, **__: str) -> None:
        before, self.desk.page = self.desk.page, self
        if before:
            before.show({"op": "refused"}, refusal("the page was opened again elsewhere and continues there").packed())
            before.close(OPENED_ELSEWHERE)
            self.show({"op": "took_over"}, Frame({"op": "took_over"}).packed())

    def on_message(self, message: str | bytes) -> None:
        try:
            asked = message_of(message)
            if self.desk.engine is None:
                raise UserError(ENGINE_GONE)
        except UserError as error:
            self.show({"op": "refused"}, refusal(str(error)).packed())
            return
        self.desk.engine.tell(json.dumps(asked))

    def on_close(self) -> None:
        if self.desk.page is self:
            self.desk.page = None

    def show(self, header: dict[str, Any], block: bytes) -> None:
        """Send a frame; one that a later frame supersedes is skipped while the page has not read the previous ones."""
        if self.unsent + len(block) > MOST_UNSENT and not header.get("final", True):
            return
        self.unsent += len(block)

        def sent(_: Any) -> None:
            self.unsent -= len(block)

        try:
            future = asyncio.ensure_future(self.write_message(block, binary=True))
        except tornado.websocket.WebSocketClosedError:
            return
        future.add_done_callback(lambda done: (sent(done), done.exception()))


def serve(command: Sequence[str], first: str, port: int, feedback: Feedback, opened: Callable[[str], None]) -> None:
    """Serve the page until the feedback requests the end; ``opened`` is called with its address when it is ready.

    Runs on a separate thread, because the cells of a notebook already run within a loop.

    command : starts the engine process, whose first line of input is ``first``
    """
    ended = threading.Event()
    with ThreadPoolExecutor(1) as thread:
        served = thread.submit(asyncio.run, _serve(command, first, port, feedback, opened, ended))
        try:
            while not served.done():
                wait([served], timeout=0.1)
        except KeyboardInterrupt:
            if not feedback.cancelled():  # otherwise it is the same Ctrl-C again, while everything is being closed
                raise
        finally:
            ended.set()
    served.result()


async def _serve(
    command: Sequence[str],
    first: str,
    port: int,
    feedback: Feedback,
    opened: Callable[[str], None],
    ended: threading.Event,
) -> None:
    desk = Desk(command, first, feedback, asyncio.get_running_loop())
    routes: list[Any] = [
        (r"/", PageFile),
        (r"/page/([A-Za-z0-9_]+\.[a-z0-9]+)", PageFile),
        (r"/tiles/(\d{1,2})/(\d{1,6})/(\d{1,6})\.png", TileFile),
        (r"/socket", Socket),
    ]
    application = tornado.web.Application(
        routes,
        default_handler_class=Missing,
        desk=desk,
        websocket_max_message_size=MOST_MESSAGE,
        log_function=lambda _: None,
    )
    try:
        sockets = tornado.netutil.bind_sockets(port, HOST)
    except OSError as error:
        raise UserError(f"--port {port}: {error.strerror or error}; choose another one, or 0 for any") from error
    desk.port = sockets[0].getsockname()[1]
    server = tornado.httpserver.HTTPServer(application, max_body_size=1 << 16, max_header_size=1 << 14)
    try:
        desk.start()
        while not desk.ready.is_set():
            await asyncio.sleep(0.05)
            if feedback.cancelled() or ended.is_set():
                raise Cancelled
        if desk.unfit is not None:
            raise UserError(desk.unfit)
        if desk.engine is None:
            raise RuntimeError("the engine process ended before it was ready")
        server.add_sockets(sockets)
        opened(desk.address)
        while not (feedback.cancelled() or ended.is_set()):
            await asyncio.sleep(0.1)
    finally:
        desk.closing = True
        server.stop()
        for each in sockets:
            with contextlib.suppress(OSError):
                each.close()
        if desk.engine:
            await asyncio.to_thread(desk.engine.end)
