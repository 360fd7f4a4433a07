"""A web server on this machine that answers each request as a test scripts it."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from mocapdb.corpus.manifest import ManifestEntry

SKELETON = b"# AST/ASF file\n:version 1.10\n" + b"# bones\n" * 100
MOTION = b"#!OML:ASF\n:FULLY-SPECIFIED\n:DEGREES\n" + b"1\nroot 1.0 2.0 3.0\n" * 4000
PAGE = b"  \n<!DOCTYPE html><html><body>Not here</body></html>"
MONDAY = "Mon, 06 Jul 2009 10:00:00 GMT"
TUESDAY = "Tue, 07 Jul 2009 10:00:00 GMT"

Answer = Callable[["Handler"], None]


class Handler(BaseHTTPRequestHandler):
    """Answers each request for a path with the next of its scripted answers."""

    protocol_version = "HTTP/1.1"
    server: Server  # type: ignore[assignment]

    def do_GET(self) -> None:
        self.server.requests.append((self.path, dict(self.headers)))
        answers = self.server.script.get(self.path, [status(404)])
        answer = answers.pop(0) if len(answers) > 1 else answers[0]
        answer(self)

    def answer(self, code: int, headers: dict[str, object], body: bytes) -> None:
        self.send_response(code)
        for name, value in headers.items():
            self.send_header(name, str(value))
        self.end_headers()
        self.wfile.write(body)

    def hang_up(self) -> None:
        self.wfile.flush()
        self.close_connection = True
        self.connection.shutdown(socket.SHUT_RDWR)

    def log_message(self, *args: object) -> None:
        """Stay silent."""


class Server(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.script: dict[str, list[Answer]] = {"/02/02.asf": [whole(SKELETON)]}
        self.requests: list[tuple[str, dict[str, str]]] = []
        self.url = f"http://127.0.0.1:{self.server_address[1]}"

    def handle_error(self, request: object, client_address: object) -> None:
        """Stay silent when a client hangs up."""

    def asked_for(self, path: str) -> list[dict[str, str]]:
        return [headers for asked, headers in self.requests if asked == path]


def whole(data: bytes, version: str = MONDAY, **headers: object) -> Answer:
    """The file from its start, whatever part was asked for."""
    answer = {"Content-Length": len(data), "Last-Modified": version, **headers}
    return lambda handler: handler.answer(200, answer, data)


def part(data: bytes, version: str = MONDAY, *, heed_if_range: bool = True) -> Answer:
    """The part that was asked for, if the client's version is the server's."""

    def answer(handler: Handler) -> None:
        wanted = handler.headers.get("Range")
        if wanted is None or (heed_if_range and handler.headers.get("If-Range") != version):
            whole(data, version)(handler)
            return
        start = int(wanted.removeprefix("bytes=").removesuffix("-"))
        if start >= len(data):
            handler.answer(416, {"Content-Length": 0}, b"")
            return
        headers = {
            "Content-Range": f"bytes {start}-{len(data) - 1}/{len(data)}",
            "Content-Length": len(data) - start,
            "Last-Modified": version,
        }
        handler.answer(206, headers, data[start:])

    return answer


def broken_off(data: bytes, size: int, version: str = MONDAY) -> Answer:
    """Hangs up after `size` bytes of the file."""

    def answer(handler: Handler) -> None:
        headers = {"Content-Length": len(data), "Last-Modified": version}
        handler.answer(200, headers, data[:size])
        handler.hang_up()

    return answer


def status(code: int, **headers: object) -> Answer:
    fields = {name.replace("_", "-"): value for name, value in headers.items()}
    return lambda handler: handler.answer(code, {"Content-Length": 0, **fields}, b"")


def stalled(data: bytes, size: int) -> Answer:
    """Sends `size` bytes, then nothing until the client hangs up."""

    def answer(handler: Handler) -> None:
        handler.answer(200, {"Content-Length": len(data), "Last-Modified": MONDAY}, data[:size])
        handler.connection.settimeout(60)
        handler.connection.recv(1)
        handler.close_connection = True

    return answer


@contextmanager
def running_server() -> Iterator[Server]:
    """Serve in a thread of its own."""
    server = Server()
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield server
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def entry(
    server: Server, clip: str = "02_01", *, sha256: str | None = None, label: str = "walk"
) -> ManifestEntry:
    subject, trial = clip.split("_")
    return ManifestEntry(
        clip=clip,
        subject=subject,
        trial=trial,
        label=label,
        description="",
        fps=120.0,
        skeleton_url=f"{server.url}/{subject}/{subject}.asf",
        motion_url=f"{server.url}/{subject}/{clip}.amc",
        sha256=sha256,
    )
