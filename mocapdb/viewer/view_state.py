"""What one browser shows. Panels read it; what changes it is asked of the session."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from mocapdb.motion.clip import Clip
from mocapdb.scenes.stage import SHOWN_FPS, Stage
from mocapdb.viewer.comparisons import COMPARISONS
from mocapdb.viewer.playback import Playback

if TYPE_CHECKING:
    from mocapdb.cleaning import MovementDigressionMap
    from mocapdb.library.clip_record import ClipRecord

__all__ = ["ViewState"]


@dataclass
class ViewState:
    """The clip that is open, and what the stage shows.

    Attributes
    ----------
    playback : Playback
        The clock.
    clip : Clip or None
        The clip that is open, decoded.
    record : ClipRecord or None
        Its row in the library.
    comparison : str
        One of `COMPARISONS`: what the clip is shown beside.
    digression_map : MovementDigressionMap or None
        What is flagged in it, once it is known; until then `waiting` says why it is not.
    selection : (float, float) or None
        The range of it that is selected, in seconds.
    stage : Stage or None
        What the stage shows, `title` is what to write above it.
    shows_clip : bool
        Whether that is the clip, and not hits or a cycle.
    follow : bool
        Whether bodies stay in sight and the ground moves under them.
    """

    playback: Playback = field(default_factory=Playback)
    clip: Clip | None = None
    record: ClipRecord | None = None
    comparison: str = COMPARISONS[0]
    digression_map: MovementDigressionMap | None = None
    waiting: str = ""
    selection: tuple[float, float] | None = None
    stage: Stage | None = None
    title: str = ""
    shows_clip: bool = True
    follow: bool = True

    @property
    def name(self) -> str:
        """The name of the clip that is open, empty if none is."""
        return "" if self.record is None else self.record.name

    @property
    def fps(self) -> float:
        """Frames a second of what is shown: the clip's own, or the stage's."""
        if self.shows_clip and self.clip is not None:
            return self.clip.fps
        return SHOWN_FPS if self.stage is None else self.stage.fps
