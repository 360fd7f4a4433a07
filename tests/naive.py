"""Naive twins: the same results as the fast code, written only to be read."""

import numpy as np
from scipy.spatial.transform import Rotation


def naive_forward_kinematics(clip):
    """World positions (F, J, 3) and rotations (F, J, 3, 3), a joint and a frame at a time."""
    skeleton = clip.skeleton
    positions = np.zeros((len(clip), skeleton.n_joints, 3))
    rotations = np.zeros((len(clip), skeleton.n_joints, 3, 3))
    for frame, channels in enumerate(clip.channels):
        column = 0
        for joint, dofs in enumerate(skeleton.dofs):
            values = dict(zip(dofs, channels[column : column + len(dofs)], strict=True))
            column += len(dofs)

            order = skeleton.rotation_orders[joint]
            turn = np.eye(3)
            for axis in order:
                vector = values[f"r{axis.lower()}"] * np.eye(3)["XYZ".index(axis)]
                turn = turn @ Rotation.from_rotvec(vector, degrees=True).as_matrix()
            axes = Rotation.from_euler("xyz", skeleton.axis_deg[joint], degrees=True).as_matrix()
            local = axes @ turn @ axes.T

            offset = skeleton.offsets[joint].copy()
            shift = np.zeros(3)
            for i, axis in enumerate("xyz"):
                if f"t{axis}" in values:
                    shift[i] = values[f"t{axis}"]
                    if skeleton.convention == "bvh":
                        offset[i] = 0.0

            parent = skeleton.parents[joint]
            above = np.eye(3) if parent < 0 else rotations[frame, parent]
            start = np.zeros(3) if parent < 0 else positions[frame, parent]
            rotations[frame, joint] = above @ local
            carrier = rotations[frame, joint] if skeleton.convention == "acclaim" else above
            positions[frame, joint] = start + above @ shift + carrier @ offset
    return positions, rotations


def naive_stretches(distances, starts):
    """Cost and first frame of the best stretch that ends at each library frame.

    A memoised walk back from (n - 1, j) over single steps, one clip at a time.
    """
    n, n_frames = distances.shape
    clip = np.searchsorted(starts, np.arange(n_frames), "right")
    found = {}

    def best(i, j):
        if (i, j) not in found:
            options = []
            for queried, moved in ((1, 1), (1, 2), (2, 1)):
                before, start = i - queried, j - moved
                charge = sum(distances[row, j] for row in range(before + 1, i + 1))
                if before == -1:
                    options.append((charge, j))
                elif before >= 0 and start >= 0 and clip[start] == clip[j]:
                    cost, first = best(before, start)
                    options.append((cost + charge, first))
            found[i, j] = min(options, default=(np.inf, -1))
        return found[i, j]

    ends = [best(n - 1, j) for j in range(n_frames)]
    return np.array([cost / n for cost, _ in ends]), np.array([first for _, first in ends])


def naive_hits(found, starts, k):
    """The k best stretches (first, end, cost): none overlaps a better one of its clip by half.

    Found are for each template the cost and the first frame of the stretch that ends at each frame.
    """
    lowest = []
    for costs, firsts in found:
        fenced = [np.inf, *costs, np.inf]
        lowest += [
            (costs[j], j, firsts[j])
            for j in range(len(costs))
            if fenced[j] > costs[j] <= fenced[j + 2]
        ]
    hits = []
    for cost, j, first in sorted(lowest):
        end = j + 1
        for a, b, _ in hits:
            same_clip = np.searchsorted(starts, a, "right") == np.searchsorted(starts, j, "right")
            if same_clip and min(end, b) - max(first, a) > 0.5 * min(end - first, b - a):
                break
        else:
            hits.append((first, end, cost))
    return hits[:k]


def naive_frame_distance(a, b, n_drop):
    """Eq. 1 of Aristidou 2018 for two poses (K, 4), without the largest joints."""
    halves = [np.arccos(min(1.0, abs(float(p @ q)))) for p, q in zip(a, b, strict=True)]
    squares = sorted(half**2 for half in halves)
    return sum(squares[: len(squares) - n_drop])


def naive_word_distance(distances):
    """The mean distance along the best path of Aristidou 2018's appendix through (N, M) distances.

    Whole numbers: of two paths with the same cost, the one with fewer cells. Every state is the
    last cell, the direction of the last step and how often it was taken in a row.
    """
    n, m = distances.shape
    best = {(i, j): {} for i in range(n) for j in range(m)}
    best[0, 0][("", 0)] = (int(distances[0, 0]), 1)
    means = []
    for i in range(n):
        for j in range(m):
            here = best[i, j]
            if here and (i == n - 1 or j == m - 1) and min(i, j) >= 10:
                cost, length = min(here.values())
                means.append(cost / length)
            for (way, run), (cost, length) in here.items():
                for new, di, dj in (("both", 1, 1), ("source", 1, 0), ("target", 0, 1)):
                    k, l = i + di, j + dj  # noqa: E741
                    again = run + 1 if new == way and new != "both" else 1
                    if k >= n or l >= m or again > 3:
                        continue
                    reached = (cost + int(distances[k, l]), length + 1)
                    best[k, l][new, again] = min(best[k, l].get((new, again), reached), reached)
    return min(means)


def naive_minima(values, own_start, k):
    """The k smallest local minima (start, value), those too near the source's own word left out."""
    found = []
    for t, value in enumerate(values):
        if t > 0 and values[t - 1] <= value:
            continue
        if t + 1 < len(values) and values[t + 1] < value:
            continue
        if abs((t + 20 / 2) - (own_start + 15 / 2)) < 15 / 2:
            continue
        found.append((value, t))
    return [(t, value) for value, t in sorted(found)[:k]]
