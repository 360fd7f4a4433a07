"""The 3-D stage of a session: ground, light, camera, and the bodies of what is shown.

The camera belongs to who looks: it is set when something new is shown, and then left alone. To
follow a body, the world moves under it instead.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.scenes.stage import VIEW_ANGLE, Stage
from mocapdb.viewer.bodies import ShownBody

__all__ = ["StageScene"]

CELL_M, SECTION_M = 0.5, 1.0  # between the ground's fine lines, and its coarse ones
FADES_M = 18.0  # how far the ground is seen
SKY, FINE_LINES, COARSE_LINES = (232, 237, 241), (205, 212, 219), (150, 162, 173)


class StageScene:
    """What a browser shows of a stage.

    Parameters
    ----------
    client : viser.ClientHandle
    """

    def __init__(self, client: Any) -> None:
        self._client = client
        scene = client.scene
        scene.set_up_direction("+y")
        scene.set_background_image(np.full((2, 2, 3), SKY, dtype=np.uint8))
        self._ground = scene.add_grid(
            "/ground", plane="xz", infinite_grid=True, cell_size=CELL_M, section_size=SECTION_M,
            cell_color=FINE_LINES, section_color=COARSE_LINES, fade_distance=FADES_M,
            fade_from="origin", shadow_opacity=0.25,
        )  # fmt: skip
        self.covered = 0.0  # share of the height that the timeline covers, from below
        self._stage: Stage | None = None
        self._bodies: list[ShownBody] = []
        self._origin = np.zeros(3)
        self._targets = np.zeros((1, 3))
        self._shown = 0

    def show(self, stage: Stage, *, keep_camera: bool = False) -> None:
        """Put a stage in place of the one before, and look at the whole of it."""
        for body in self._bodies:
            body.remove()
        self._shown += 1
        most = stage.most_error_mm
        scene = self._client.scene
        self._bodies = [
            ShownBody(scene, f"/stage{self._shown}/body{i}", actor, most)
            for i, actor in enumerate(stage.actors)
        ]
        self._stage = stage
        camera = stage.camera()
        self._targets = camera.targets
        if not keep_camera:
            self._look(camera.targets[0], camera.yaw, camera.pitch, camera.distance)

    def draw(self, time_s: float, *, follow: bool) -> None:
        """Show the stage at a time; to follow the bodies, the world moves under them."""
        stage = self._stage
        if stage is None:
            return
        frame = min(round(time_s * stage.fps), stage.n_frames - 1)
        if follow:
            self._origin = self._targets[frame] * [1.0, 0.0, 1.0]
        with self._client.atomic():
            x, _, z = self._origin
            self._ground.position = (-math.fmod(x, SECTION_M), 0.0, -math.fmod(z, SECTION_M))
            for body in self._bodies:
                body.draw(frame, self._origin)

    def _look(self, target: FloatArray, yaw: float, pitch: float, distance: float) -> None:
        self._origin = target * [1.0, 0.0, 1.0]
        distance /= 1.0 - self.covered
        lift = self.covered * distance * math.tan(VIEW_ANGLE / 2)
        centre = np.array([0.0, target[1] - lift, 0.0])
        back = np.array(
            [math.sin(yaw) * math.cos(pitch), math.sin(pitch), math.cos(yaw) * math.cos(pitch)]
        )
        camera = self._client.camera
        with self._client.atomic():
            camera.fov = VIEW_ANGLE
            camera.position = centre + distance * back
            camera.look_at = centre
