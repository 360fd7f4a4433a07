"""What may stand between the edges of a joint."""

import numpy as np
import pytest

from mocapdb.cleaning import detect_faults
from mocapdb.cleaning.evidence.hypotheses import find_hypotheses
from mocapdb.cleaning.local_rotations import local_rotations
from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError


@pytest.fixture(scope="module")
def run():
    return synthetic.make_clip("run", seed=4, sensor_noise_deg=0.02, phase_noise=0.2)


def turned(clip, name, start, end, degrees):
    channels = clip.channels.copy()
    channels[start:end, int(clip.skeleton.channel_starts[clip.skeleton.joint(name)])] += degrees
    return clip.replace(channels=channels)


def test_a_fault_may_be_cut_off_by_an_end_of_the_clip(run):
    for start, end in ((0, 60), (540, 600)):
        texture = local_rotations(turned(run, "lradius", start, end, 60.0))
        row = texture.names.index("lradius")
        found = [h for h in find_hypotheses(texture) if h.row == row and h.cue == "cut off"]
        assert (start, end, "offset") in [(h.start, h.end, h.kind) for h in found]
    (span,) = detect_faults(turned(run, "lradius", 0, 60, 60.0)).spans
    assert run.skeleton.names[span.joint] == "lradius"
    assert span.end == 60


def test_what_is_cut_off_is_the_lesser_part(run):
    clip = run[:240]
    texture = local_rotations(turned(clip, "lradius", 0, 200, 60.0))
    row = texture.names.index("lradius")
    shapes = [h for h in find_hypotheses(texture) if h.row == row and h.cue == "cut off"]
    assert [(h.start, h.end) for h in shapes] == [(200, 240)]


@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5, 6])
def test_a_joint_that_is_held_may_tremble(run, seed):
    faulty, _, (fault,) = synthetic.inject_faults(
        run, seed=seed, kinds=["freeze"], n=1, length_s=0.4, tremble_deg=0.3
    )
    row = local_rotations(run).joints.tolist().index(fault.joint)
    held = [h for h in find_hypotheses(local_rotations(faulty)) if h.row == row and h.cue == "held"]
    if fault.size_deg < 20:
        pytest.skip("a freeze where the joint hardly moves leaves no edge")
    spans = [span for span in detect_faults(faulty).spans if span.joint == fault.joint]
    assert any(abs(h.end - fault.end) <= 1 for h in held) or spans
    assert len(spans) == 1
    shared = min(spans[0].end, fault.end) - max(spans[0].start, fault.start)
    assert shared > 0.5 * (fault.end - fault.start)


def test_trembling_follows_from_the_seed_and_stays_in_the_span(run):
    calm, tremble = (
        synthetic.inject_faults(
            run, seed=3, kinds=["freeze"], n=1, length_s=0.4, tremble_deg=size
        ) for size in (0.0, 0.5)
    )  # fmt: skip
    (fault,) = tremble.faults
    assert (fault.joint, fault.start, fault.end) == (
        calm.faults[0].joint, calm.faults[0].start, calm.faults[0].end,
    )  # fmt: skip
    apart = np.abs(tremble.clip.channels - calm.clip.channels)
    assert 0.1 < apart[fault.start : fault.end].max() < 3.0
    apart[fault.start : fault.end] = 0.0
    assert apart.max() == 0.0
    with pytest.raises(ClipError, match="tremble_deg"):
        synthetic.inject_faults(run, seed=3, tremble_deg=(0.5, 0.1))


def test_noise_in_nearly_all_of_a_clip_is_noise(run):
    faulty, _, (fault,) = synthetic.inject_faults(
        run[:240], seed=1, kinds=["noise"], n=1, length_s=1.8, size_deg=60
    )
    (span,) = detect_faults(faulty).spans
    assert (span.joint, span.kind) == (fault.joint, "noise")
    assert span.end - span.start > 0.9 * (fault.end - fault.start)
