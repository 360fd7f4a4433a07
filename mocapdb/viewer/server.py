"""The web server of the viewer; every browser that comes gets a session of its own."""

from __future__ import annotations

import io
import socket
import time
import warnings
from contextlib import AbstractContextManager, redirect_stdout
from pathlib import Path
from typing import Any

from mocapdb.base.arrays import StrPath
from mocapdb.errors import LibraryError, MissingExtraError
from mocapdb.viewer.gate import Gate, guarding
from mocapdb.viewer.pictures import Pictures
from mocapdb.viewer.session import Session

__all__ = ["DEFAULT_PORT", "Viewer"]

DEFAULT_PORT = 8080
TRIED_PORTS = 20  # ports in a row that may be taken


class Viewer:
    """A library served to browsers, until `close`.

    Parameters
    ----------
    path : path-like
        The library.
    host : str
        Address to listen at. Only this machine reaches the default. Whoever has the whole `url`
        is let in, nobody else.
    port : int
        The first port to try; the next ones are tried if it is taken. 0 takes any.
    clip : str, optional
        The clip that sessions open first.
    original : bool
        Whether clips are shown as they were captured, also where they were cleaned since.

    Raises
    ------
    MissingExtraError
        If viser is not installed.
    LibraryError
        If it is no library, or no port is free.
    UnknownClipError
        If there is no such clip.
    """

    def __init__(
        self,
        path: StrPath,
        *,
        host: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        clip: str | None = None,
        original: bool = False,
    ) -> None:
        try:
            import viser
        except ImportError:
            raise MissingExtraError("viser", "viewer") from None
        from mocapdb.library import Library

        self.path = Path(path)
        with Library(self.path) as library:  # says early what is wrong
            opening = None if clip is None else library.record(clip).name
        self.host, self.port = host, _free_port(host, port)
        self._sessions: dict[int, Session] = {}
        # a browser may leave between a frame and the news that it has left
        warnings.filterwarnings("ignore", "Queued a .* on a closed connection", UserWarning)
        self._gate = Gate(host, self.port)
        self._pictures = Pictures(self.path, original=original)
        with _quietly(), guarding(self._gate, self._pictures.answer):
            self._server: Any = viser.ViserServer(host=host, port=self.port, verbose=False)
        if not self._gate.is_shut:  # a viser that starts its server in another way
            self.close()
            raise LibraryError(
                "Expected a viser whose server can be guarded, but this one starts it in another "
                "way. Install: pip install 'mocapdb[viewer]'"
            )
        self._server.scene.world_axes.visible = False

        def connect(client: Any) -> None:
            session = Session(client, self.path, opening, original=original)
            self._sessions[client.client_id] = session
            session.start()

        def disconnect(client: Any) -> None:
            session = self._sessions.pop(client.client_id, None)
            if session is not None:
                session.close()

        self._server.on_client_connect(connect)
        self._server.on_client_disconnect(disconnect)

    @property
    def url(self) -> str:
        """What to open in a browser on this machine; without its token nobody is let in."""
        local = self.host in {"127.0.0.1", "0.0.0.0", "localhost", "::"}
        host = "127.0.0.1" if local else f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{host}:{self.port}/?token={self._gate.token}"

    def wait(self) -> None:
        """Serve until interrupted."""
        while True:
            time.sleep(3600)

    def close(self) -> None:
        """End every session and stop the server."""
        sessions = list(self._sessions.values())
        self._sessions.clear()
        for session in sessions:
            session.close()
        for session in sessions:
            session.join(5.0)
        self._pictures.close()
        with _quietly():
            self._server.stop()

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _quietly() -> AbstractContextManager[Any]:
    """Keep viser from printing what we say ourselves."""
    return redirect_stdout(io.StringIO())


def _free_port(host: str, first: int) -> int:
    """Return the first port from `first` on that nobody listens at."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    for port in [0] if first == 0 else range(first, first + TRIED_PORTS):
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((host, port))
            except OSError:
                continue
            return int(probe.getsockname()[1])
    raise LibraryError(
        f"Expected a free port at {host} from {first} to {first + TRIED_PORTS - 1}, but every one "
        "is taken, or the address is not this machine's. Give another --port or --host."
    )
