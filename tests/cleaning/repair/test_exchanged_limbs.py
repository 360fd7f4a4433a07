"""A limb that was exchanged is swapped back as one, whatever its joints look like."""

import numpy as np
import pytest

from mocapdb.cleaning import Span, detect_faults, repair_spans
from mocapdb.cleaning.local_rotations import local_rotations
from mocapdb.cleaning.repair.exchanged_limbs import find_swaps
from mocapdb.cleaning.repair.gaps import Gap
from mocapdb.corpus import synthetic
from mocapdb.motion.body.joint_names import across_by_names

START, END = 130, 190


@pytest.fixture(scope="module")
def walk():
    return synthetic.make_clip("walk", seed=11, duration_s=3, sensor_noise_deg=0.02)


def exchanged(walk, ends):
    """The clip with joints of left and right exchanged from `START` to an end."""
    channels = walk.channels.copy()
    for name, end in ends.items():
        left, right = (
            walk.skeleton.rotation_columns(walk.skeleton.joint(side + name)) for side in "lr"
        )
        inside = slice(START, end)
        channels[inside, left] = walk.channels[inside, right]
        channels[inside, right] = walk.channels[inside, left]
    return walk.replace(channels=channels)


def spans_of(walk, kinds):
    return [
        Span(START, end, walk.skeleton.joint(name), 0.9, kind)
        for name, (kind, end) in kinds.items()
    ]


def swapped(faulty, spans):
    """Names of the joints that are swapped back."""
    texture = local_rotations(faulty)
    found = detect_faults(faulty, similarity=False)
    rows = {joint: row for row, joint in enumerate(texture.joints.tolist())}
    across = across_by_names(faulty.skeleton.names)
    gaps = {}
    for span in spans:
        wrong = np.zeros(len(faulty), dtype=bool)
        wrong[span.frames] = True
        opposite = rows[int(across[span.joint])]
        gaps[span] = Gap(texture, rows[span.joint], span, wrong, 5.0, found, opposite)
    swaps = find_swaps(faulty.skeleton, across, gaps)
    return {faulty.skeleton.names[span.joint] for span in swaps}


def test_a_leg_is_swapped_back_as_one(walk):
    faulty = exchanged(walk, {"femur": END, "tibia": END, "foot": END})
    kinds = dict.fromkeys(("rfemur", "ltibia", "rtibia", "lfoot", "rfoot"), ("offset", END)) | {
        "lfemur": ("exchange", END),
        "lhumerus": ("offset", END),
        "rhumerus": ("offset", END),
    }
    spans = spans_of(walk, kinds)
    mended, repairs = repair_spans(faulty, detect_faults(faulty, similarity=False), spans)
    told = {walk.skeleton.names[repair.span.joint]: repair for repair in repairs}
    legs = {side + name for side in "lr" for name in ("femur", "tibia", "foot")}
    assert {name for name, repair in told.items() if repair.method == "swapped back"} == legs
    assert {told[name].span.kind for name in legs} == {"exchange"}
    for name in legs:
        own = walk.skeleton.rotation_columns(walk.skeleton.joint(name))
        np.testing.assert_allclose(mended.channels[:, own], walk.channels[:, own], atol=1e-6)


@pytest.mark.parametrize(("length", "alike"), [(48, True), (47, False)])
def test_joints_of_a_limb_are_exchanged_at_the_same_time(walk, length, alike):
    """Four fifths of 60 frames are the same time."""
    ends = {"femur": END, "tibia": START + length}
    kinds = {side + name: ("offset", end) for side in "lr" for name, end in ends.items()}
    spans = spans_of(walk, kinds | {"lfemur": ("exchange", END)})
    expected = {"lfemur", "rfemur"} | ({"ltibia", "rtibia"} if alike else set())
    assert swapped(exchanged(walk, ends), spans) == expected


def test_offsets_alone_are_no_exchange(walk):
    ends = {"femur": END, "tibia": END}
    kinds = {side + name: ("offset", END) for side in "lr" for name in ends}
    assert swapped(exchanged(walk, ends), spans_of(walk, kinds)) == set()


def test_what_swapping_does_not_mend_is_not_swapped(walk):
    kinds = {side + name: ("exchange", END) for side in "lr" for name in ("femur", "tibia")}
    assert swapped(exchanged(walk, {"femur": END}), spans_of(walk, kinds)) == {"lfemur", "rfemur"}
