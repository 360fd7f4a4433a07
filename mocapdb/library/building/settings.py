"""How a build encodes its clips."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from mocapdb.compression.targets import ByteBudget, Target

if TYPE_CHECKING:
    from mocapdb.io.reading import ReadOptions

__all__ = ["BuildSettings", "reading_of"]


@dataclass(frozen=True)
class BuildSettings:
    """How clips are encoded.

    Parameters
    ----------
    target : Target or ByteBudget
        The error, or the number of bytes a frame, that no clip may exceed.
    codec : dict
        Keyword arguments of `mocapdb.compression.encode`.
    drop_tpose : bool
        Whether to leave out a T-pose in front of the motion.
    """

    target: Target | ByteBudget
    codec: dict[str, Any] = field(default_factory=dict)
    drop_tpose: bool = False

    def __post_init__(self) -> None:
        if isinstance(self.target, Target):  # so that settings say what is promised
            target = self.target.for_codec("okane" if self.is_okane else "pose")
            object.__setattr__(self, "target", target)

    @classmethod
    def from_json(cls, text: str) -> BuildSettings:
        """Return the settings that `to_json` made a text of.

        Examples
        --------
        >>> settings = BuildSettings(Target("max_mm", 2.0), {"codec": "pose"})
        >>> BuildSettings.from_json(settings.to_json()) == settings
        True
        """
        from mocapdb.compression import Budgets

        kept = json.loads(text)
        target, codec = dict(kept["target"]), dict(kept.get("codec", {}))
        if codec.get("shares"):
            codec["shares"] = Budgets(**codec["shares"])
        kind = ByteBudget if "bytes_per_frame" in target else Target
        return cls(kind(**target), codec, kept.get("drop_tpose", False))

    @property
    def is_okane(self) -> bool:
        """Whether the codec is O'Kane's: named, or the only one that takes such options."""
        named = self.codec.get("codec")
        own = ("representation", "shares", "wavelet")
        return bool(named == "okane" or (named is None and any(map(self.codec.get, own))))

    @property
    def shares_axes(self) -> bool:
        """Whether clips of a class are to share axes that the library keeps."""
        shares = self.codec.get("shares")
        wanted = {"auto", "class", None} if self.is_okane else {"auto", "class"}
        without_pca = shares is not None and shares.pca == 0
        return self.codec.get("decorrelation") in wanted and not without_pca

    def to_json(self, reading: ReadOptions | None = None) -> str:
        """Return the settings as text; equal settings give equal text.

        Parameters
        ----------
        reading : ReadOptions, optional
            What is said of a file, which is noted with its settings.
        """
        said = reading.to_dict() if reading else {}
        return json.dumps(asdict(self) | ({"reading": said} if said else {}), sort_keys=True)


def reading_of(settings: str) -> ReadOptions:
    """Return what was said of a clip's file when it was built, by the settings kept with the clip.

    Examples
    --------
    >>> from mocapdb.io import ReadOptions
    >>> settings = BuildSettings(Target("mean_mm", 1.0))
    >>> reading_of(settings.to_json(ReadOptions(unit_m=0.01)))
    ReadOptions(unit_m=0.01, up=None, fps=None, skeleton=None, joint_map=None, strict=False)
    """
    from mocapdb.io.reading import ReadOptions

    return ReadOptions(**json.loads(settings).get("reading", {}))
