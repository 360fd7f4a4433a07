"""What a figure was measured on: the kind of machine, and the versions of what ran."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterable
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

__all__ = ["measured_on"]

CPU_INFO = Path("/proc/cpuinfo")
RAN = ("numpy", "scipy")


def measured_on(packages: Iterable[str] = RAN) -> dict[str, str]:
    """Return the processor, how many cores there are to use, versions, and the date.

    Nothing says which machine it is: no name of a host and no path.

    Examples
    --------
    >>> list(measured_on(["numpy"]))
    ['date', 'processor', 'cores', 'system', 'python', 'mocapdb', 'numpy']
    """
    from mocapdb import __version__

    told = {
        "date": datetime.now(UTC).date().isoformat(),
        "processor": _processor(),
        "cores": str(_cores()),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "mocapdb": __version__,
    }
    return told | {name: _version(name) for name in packages}


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"


def _cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _processor() -> str:
    """Return the processor's name as its maker gives it, where the system tells."""
    try:
        lines = CPU_INFO.read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    for line in lines:
        name, _, value = line.partition(":")
        if name.strip() == "model name" and value.strip():
            return value.strip()
    return platform.processor() or "unknown"
