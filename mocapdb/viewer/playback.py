"""Where in time a session is: a clock that can be stopped, moved, sped up and looped."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["SPEEDS", "Playback"]

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0)


@dataclass
class Playback:
    """The clock of what is shown.

    Attributes
    ----------
    duration_s : float, seconds
        From the first frame to the last.
    time_s : float, seconds
    speed : float
    playing, loop : bool

    Examples
    --------
    >>> clock = Playback(duration_s=2.0, playing=True, speed=0.5)
    >>> clock.advance(3.0)
    >>> clock.time_s
    1.5
    >>> clock.advance(2.0)  # past the end, and on from the beginning
    >>> clock.time_s
    0.5
    """

    duration_s: float = 0.0
    time_s: float = 0.0
    speed: float = 1.0
    playing: bool = False
    loop: bool = True

    def restart(self, duration_s: float, *, playing: bool) -> None:
        """Begin something of that length; speed and loop stay."""
        self.duration_s, self.time_s, self.playing = max(duration_s, 0.0), 0.0, playing

    def seek(self, time_s: float) -> None:
        """Go to a time, as near as there is one."""
        self.time_s = min(max(time_s, 0.0), self.duration_s)

    def toggle(self) -> None:
        """Play or pause; at the end, from the beginning."""
        self.playing = not self.playing
        if self.playing and self.time_s >= self.duration_s:
            self.time_s = 0.0

    def advance(self, seconds: float) -> None:
        """Let time pass, if it is playing."""
        if not self.playing or self.duration_s <= 0:
            return
        self.time_s += self.speed * seconds
        if self.time_s > self.duration_s:
            if self.loop:
                self.time_s %= self.duration_s
            else:
                self.time_s, self.playing = self.duration_s, False
