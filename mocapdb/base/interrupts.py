"""Ctrl-C where Python would lose it: in destructors, and in functions that SQLite calls."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

LATER_S = 0.2
"""Seconds until Ctrl-C comes again: what lost it has returned by then."""


@contextmanager
def no_interrupt_lost() -> Iterator[None]:
    """Send Ctrl-C again where it hits a destructor: Python would print it there, and go on."""
    report = sys.unraisablehook

    def resend(lost: Any) -> None:
        if lost.exc_type is KeyboardInterrupt:
            interrupt_later()
        else:
            report(lost)

    sys.unraisablehook = resend
    try:
        yield
    finally:
        sys.unraisablehook = report


def interrupt_later() -> None:
    """Send Ctrl-C to the main thread in a moment; it also wakes where it sleeps or waits."""
    again = threading.Timer(LATER_S, _interrupt_main_thread)
    again.daemon = True  # it does not keep a program that ends before from ending
    again.start()


def _interrupt_main_thread() -> None:
    main_thread = threading.main_thread().ident
    if main_thread is not None and hasattr(signal, "pthread_kill"):
        signal.pthread_kill(main_thread, signal.SIGINT)
    else:  # Windows
        signal.raise_signal(signal.SIGINT)
