"""Work for other processes, which import it by its name."""

import os
import signal
import time
from pathlib import Path


def double(x: int) -> int:
    time.sleep(0.05 if x == 0 else 0)  # the others overtake it
    return 2 * x


def who(_: int) -> int:
    return os.getpid()


def kill_once(done: Path, x: int) -> int:
    """Kill the process that does this, the first time."""
    if x == 2 and not done.exists():
        done.write_text("done")
        os.kill(os.getpid(), signal.SIGKILL)
    return x


def kill(_: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return 0
