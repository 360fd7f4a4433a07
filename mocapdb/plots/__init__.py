"""Every picture, one function each.

``skeleton_strip``     poses of a clip, or of several to compare, along a strip of time
``rate_distortion``    bytes a frame against the error that they leave

Each takes ``ax=None``, draws there or on new axes, and returns the axes. They need matplotlib:
``pip install 'mocapdb[plot]'``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mocapdb.plots.rate import rate_distortion
    from mocapdb.plots.strip import skeleton_strip

__all__ = ["rate_distortion", "skeleton_strip"]

_HOMES = {"rate_distortion": "rate", "skeleton_strip": "strip"}


def __getattr__(name: str) -> Any:
    """Load a picture on first use."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
