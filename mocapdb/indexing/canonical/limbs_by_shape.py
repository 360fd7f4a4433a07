"""Finding arms, legs and spine in a skeleton with unknown names, by the shape of its rest pose."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import SkeletonError
from mocapdb.indexing.tuning import MIRROR_TOLERANCE, SAME_PLACE
from mocapdb.motion.kinematics import to_metres
from mocapdb.motion.representations import UNIVERSAL_BONES_M, UNIVERSAL_HEIGHT_M
from mocapdb.motion.skeleton import Skeleton

__all__ = ["guess_bones"]

UP = 1


def guess_bones(skeleton: Skeleton) -> dict[str, tuple[int, int]]:
    """Return the (from, to) joints of each bone of the canonical body.

    Feet are the lowest ends of the rest pose on either side, the head is its highest end, hands
    are the ends that stick out furthest. Along a limb the joints are those whose distances are
    nearest to a human's; left is where it is when the toes point forward.

    Raises
    ------
    SkeletonError
        If the rest pose is not that of a body with two legs, two arms and a head.
    """
    return _Body(skeleton).bones()


class _Body:
    """The rest pose of a skeleton, in units of its stature."""

    def __init__(self, skeleton: Skeleton) -> None:
        self._skeleton = skeleton
        rest = to_metres(skeleton, skeleton.rest_positions)
        self._stature = float(np.ptp(rest[:, UP]))
        if self._stature < SAME_PLACE:
            raise self._error("a body of some height", "a flat rest pose")
        self._at = rest / self._stature
        self._ends = [j for j, children in enumerate(skeleton.children) if not children]

    def bones(self) -> dict[str, tuple[int, int]]:
        feet = self._pair(-self._at[:, UP], "feet", avoid=())
        head = max(self._ends, key=lambda j: self._at[j, UP])
        across = self._at[feet[0]] - self._at[feet[1]]
        reach = np.abs(self._at @ (across / np.linalg.norm(across)))
        hands = self._pair(reach, "hands", avoid=(*feet, head))
        if (self._at[hands[0]] - self._at[hands[1]]) @ across < 0:
            hands = hands[::-1]

        chest = self._meeting(*hands)
        legs = [self._limb(self._path(0, foot), "femur", "tibia") for foot in feet]
        arms = [self._limb(self._path(chest, hand), "humerus", "radius") for hand in hands]
        toes = self._at[list(feet)].mean(axis=0) - self._at[[leg[2] for leg in legs]].mean(axis=0)
        left = np.cross([0.0, 1.0, 0.0], toes)
        sides = ("left", "right") if across @ left > 0 else ("right", "left")

        spine = self._path(0, chest)
        if head in (*feet, *hands) or chest == 0 or len(spine) < 2:
            raise self._error("a spine with arms and a head on it", "none")
        middle = spine[len(spine) // 2] if len(spine) > 2 else chest
        bones = {
            "spine": (0, middle),
            "chest": (spine[0], chest) if middle == chest else (middle, chest),
            "head": (chest, self._neck_end(chest, head)),
        }
        for side, leg, foot, arm in zip(sides, legs, feet, arms, strict=True):
            bones |= {
                f"{side}_shoulder": (int(self._skeleton.parents[arm[0]]), arm[0]),
                f"{side}_elbow": (arm[0], arm[1]),
                f"{side}_wrist": (arm[1], arm[2]),
                f"{side}_knee": (leg[0], leg[1]),
                f"{side}_ankle": (leg[1], leg[2]),
                f"{side}_toe": (leg[2], self._ball(leg[2], foot)),
            }
        return bones

    def _pair(self, score: FloatArray, what: str, avoid: tuple[int, ...]) -> tuple[int, int]:
        """Return the two ends of highest score that are far apart and mirror each other."""
        best: tuple[float, tuple[int, int]] | None = None
        for a, b in combinations((end for end in self._ends if end not in avoid), 2):
            apart = np.linalg.norm((self._at[a] - self._at[b])[[0, 2]])
            unlike = abs(self._at[a, UP] - self._at[b, UP])
            if apart < MIRROR_TOLERANCE / 2 or unlike > MIRROR_TOLERANCE:
                continue
            if self._depth(a) < 3 or self._depth(b) < 3:
                continue
            total = float(min(score[a], score[b]) + 0.01 * apart)
            if best is None or total > best[0]:
                best = total, (a, b)
        if best is None:
            raise self._error(f"a pair of {what} in the rest pose", "none")
        return best[1]

    def _limb(self, path: list[int], upper: str, lower: str) -> tuple[int, int, int]:
        """Return the three joints on a path that are spaced most like a limb's."""
        wanted = np.array([UNIVERSAL_BONES_M["l" + bone] for bone in (upper, lower)])
        wanted /= UNIVERSAL_HEIGHT_M

        def misfit(joints: tuple[int, ...]) -> float:
            lengths = np.linalg.norm(np.diff(self._at[list(joints)], axis=0), axis=1)
            return float(np.square(lengths - wanted).sum())

        triples = list(combinations(path[1:], 3))
        if not triples:
            raise self._error("limbs of two bones", f"fewer above {self._name(path[-1])}")
        a, b, c = min(triples, key=misfit)
        return a, b, c

    def _ball(self, ankle: int, end: int) -> int:
        """Return the first joint beyond an ankle that is not in the same place."""
        for joint in self._path(ankle, end)[1:]:
            if np.linalg.norm(self._at[joint] - self._at[ankle]) > SAME_PLACE:
                return joint
        raise self._error("feet of some length", f"an ankle {self._name(ankle)} without one")

    def _neck_end(self, chest: int, head: int) -> int:
        """Return the joint before the top of the head, if there is one above the chest."""
        path = [j for j in self._path(chest, head)[1:] if self._is_apart(j, chest)]
        if not path:
            raise self._error("a head above the chest", "none")
        before = [j for j in path[:-1] if self._is_apart(j, head)]
        return before[-1] if before else path[-1]

    def _is_apart(self, a: int, b: int) -> bool:
        return bool(np.linalg.norm(self._at[a] - self._at[b]) > SAME_PLACE)

    def _meeting(self, a: int, b: int) -> int:
        """Return the last joint that the ways to two ends share."""
        shared = [x for x, y in zip(self._path(0, a), self._path(0, b), strict=False) if x == y]
        return shared[-1]

    def _path(self, start: int, end: int) -> list[int]:
        """Return the joints from one joint down to another, both included."""
        path = [end]
        while path[-1] != start:
            path.append(int(self._skeleton.parents[path[-1]]))
        return path[::-1]

    def _depth(self, joint: int) -> int:
        return len(self._path(0, joint)) - 1

    def _name(self, joint: int) -> str:
        return repr(self._skeleton.names[joint])

    def _error(self, expected: str, found: str) -> SkeletonError:
        return SkeletonError(
            f"Cannot map skeleton {self._skeleton.name!r} to the canonical body: expected "
            f"{expected}, but found {found}."
        )
