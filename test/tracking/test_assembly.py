# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Colour and depth into frames: every colour image becomes a frame or a refusal with a code, exactly once."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vigg_ros.registration import Camera
from vigg_ros.registration.options import PairingConfig
from vigg_ros.sensors.observation import Calibration, ColourImage, DepthImage, StampedPose
from vigg_ros.sensors.rectification import Rectifier
from vigg_ros.tracking.assembly import FrameAssembler, Refusal, SyncedFrame, SyncedMessages
from vigg_ros_testing.pipeline_runs import assemble

START_NS = 1_772_013_245_123_456_789
MS = 1_000_000
CAMERA = Camera(width_px=8, height_px=6, fx_px=7.0, fy_px=7.0, cx_px=3.5, cy_px=2.5)
PAIRING = PairingConfig(sync_slop_s=0.02, queue_size=5)


def colour(at_ms, shape=(6, 8, 3), grey=0):
    return ColourImage(START_NS + at_ms * MS, "optical", np.full(shape, grey, np.uint8))


def depth(at_ms, shape=(6, 8), metres=1.0):
    return DepthImage(START_NS + at_ms * MS, "optical", np.full(shape, metres, np.float32))


def calibration(at_ms=0, camera=CAMERA, **fields):
    return Calibration(START_NS + at_ms * MS, "optical", camera, **fields)


def pair(at_ms):
    return colour(at_ms), depth(at_ms)


def built(observations, *, flush=True):
    assembler = FrameAssembler(PAIRING)
    return assemble(assembler, *observations, end=flush)


def summary(assembled):
    """When (ms), and "frame" or the code of the refusal."""
    return [
        ((one.frame.stamp_ns - START_NS) // MS, "frame") if isinstance(one, SyncedFrame)
        else ((one.stamp_ns - START_NS) // MS, one.code)
        for one in assembled
    ]  # fmt: skip


def test_a_frame_has_the_stamp_and_name_of_its_colour_image_and_the_depth_beside_it():
    (made,) = built([calibration(), depth(15, metres=2.5), colour(10, grey=7), depth(90)])
    assert (made.frame.stamp_ns, made.frame_id, made.session) == (START_NS + 10 * MS, "optical", 0)
    assert (made.frame.image == 7).all()
    np.testing.assert_allclose(made.frame.points()[:, 2], 2.5)
    assert made.frame.camera == CAMERA


@pytest.mark.parametrize("depth_ms", [10, 15, 4])
def test_a_frame_knows_how_far_apart_its_image_and_depth_were_taken(depth_ms):
    (made,) = built([calibration(), *sorted((depth(depth_ms), colour(10)), key=lambda one: one.stamp_ns)])
    assert made.frame.apart_s == pytest.approx(abs(depth_ms - 10) / 1000)


@pytest.mark.hostile("CameraInfo: missing: WAITING")
def test_frames_wait_for_the_first_calibration():
    early = [*pair(0), *pair(100), *pair(200)]
    assert built(early, flush=False) == []
    assert summary(built([*early, calibration(300)], flush=False)) == [(0, "frame"), (100, "frame"), (200, "frame")]


def test_what_waits_too_long_for_a_calibration_is_refused():
    """The queue of 5 stays full of the newest; without any calibration the end refuses the rest."""
    assembler = FrameAssembler(PAIRING)
    done = [item for k in range(20) for item in assemble(assembler, *pair(100 * k))]
    assert summary(done) == [(100 * k, "NO_CALIBRATION") for k in range(15)]
    assert "a CameraInfo message" in done[0].message
    assert summary(assemble(assembler, end=True)) == [(100 * k, "NO_CALIBRATION") for k in range(15, 20)]


def test_an_unpaired_image_is_refused_in_its_place_and_needs_no_calibration():
    assert summary(built([colour(0), depth(100), colour(100)], flush=False)) == [(0, "UNPAIRED")]
    done = built([calibration(), *pair(0), colour(100), *pair(200), colour(300), depth(330)])
    assert summary(done) == [(0, "frame"), (100, "UNPAIRED"), (200, "frame"), (300, "UNPAIRED")]
    assert "no depth image" in done[1].message


@pytest.mark.hostile("Image: depth and image of different size R")
def test_depth_of_another_size_is_refused_and_the_next_frame_is_not():
    done = built([calibration(), colour(0), depth(0, (3, 4)), *pair(100)])
    assert summary(done) == [(0, "DEPTH_SIZE"), (100, "frame")]
    assert "(3, 4)" in done[0].message


SIZE_ROW = pytest.mark.hostile("Image: image and CameraInfo of different size but equal aspect: scale K, A, else R")


@SIZE_ROW
def test_an_image_of_another_aspect_is_refused():
    done = built([calibration(), colour(0, (6, 12, 3)), depth(0, (6, 12)), *pair(100)])
    assert summary(done) == [(0, "CALIBRATION_SIZE"), (100, "frame")]
    assert "12x6" in done[0].message
    assert "8x6" in done[0].message


@SIZE_ROW
def test_an_image_of_equal_aspect_gets_a_scaled_camera():
    (made,) = built([calibration(), colour(0, (12, 16, 3)), depth(0, (12, 16))])
    # Twice the size: the edge of the first pixel stays at -0.5, so 3.5 goes to 2 (3.5 + 0.5) - 0.5.
    assert made.frame.camera == Camera(16, 12, 14.0, 14.0, 7.5, 5.5)
    refused = built([calibration(cropped=True), colour(0, (12, 16, 3)), depth(0, (12, 16))])
    assert summary(refused) == [(0, "CALIBRATION_SIZE")]


def test_raw_images_are_rectified_together_with_their_depth():
    """A lens without distortion and a rectified camera with its centre one pixel to the left."""
    shifted = replace(CAMERA, cx_px=2.5)
    rectifier = Rectifier(CAMERA, shifted, "plumb_bob", (0.0, 0.0, 0.0, 0.0))
    image = np.tile(np.arange(8, dtype=np.uint8) * 10, (6, 1))
    metres = np.tile(np.arange(1, 9, dtype=np.float32), (6, 1))
    raw = ColourImage(START_NS, "optical", image), DepthImage(START_NS, "optical", metres)
    (made,) = built([calibration(camera=shifted, rectifier=rectifier), *raw])
    # Column u of the rectified image shows column u + 1 of the raw one; the last shows nothing.
    assert made.frame.image[2, :7].tolist() == [10, 20, 30, 40, 50, 60, 70]
    z = made.frame.points()[:, 2]
    assert sorted(set(z.tolist())) == [2, 3, 4, 5, 6, 7, 8]


@pytest.mark.hostile("CameraInfo: changes mid-run: drop keyframes, N")
def test_another_calibration_starts_another_session():
    fx_px = [7.0, 7.0, 9.0, 9.0, 7.0]
    cameras = [replace(CAMERA, fx_px=value) for value in fx_px]
    done = built(one for k, camera in enumerate(cameras) for one in (calibration(100 * k, camera), *pair(100 * k)))
    assert [item.session for item in done] == [0, 0, 1, 1, 2]
    assert [item.frame.camera.fx_px for item in done] == fx_px


BACK_ROW = pytest.mark.hostile("Stamps: back by less than 1 s R, by more: reset")


@BACK_ROW
def test_a_clock_that_jumps_back_starts_another_session():
    done = built([calibration(), *pair(5000), *pair(5100), *pair(1000), *pair(1100)])
    assert summary(done) == [(5000, "frame"), (5100, "frame"), (1000, "frame"), (1100, "frame")]
    assert [item.session for item in done] == [0, 0, 1, 1]


@BACK_ROW
def test_late_and_duplicate_images_are_refused_by_code():
    done = built([calibration(), *pair(1000), colour(1000), colour(500), depth(1000), *pair(1100)])
    assert Counter(code for _, code in summary(done)) == {"frame": 2, "STAMP_DUPLICATE": 2, "STAMP_LATE": 1}
    leads = {(item.code, item.leads) for item in done if isinstance(item, Refusal)}
    assert leads == {("STAMP_DUPLICATE", True), ("STAMP_LATE", True), ("STAMP_DUPLICATE", False)}
    assert {item.session for item in done} == {0}


def test_sessions_by_clock_and_by_camera_do_not_cancel():
    other = replace(CAMERA, fx_px=9.0)
    done = built([calibration(), *pair(5000), *pair(1000), calibration(0, other), *pair(1100), *pair(0), *pair(100)])
    sessions = [item.session for item in done]
    assert sessions == sorted(sessions)
    assert len(set(sessions)) == 4


def test_what_is_no_colour_image_gives_nothing():
    truth = StampedPose(START_NS, "map", "optical", np.eye(4))
    assert summary(built([truth, calibration(), truth, *pair(0), truth], flush=False)) == [(0, "frame")]
    assert built([]) == built([truth]) == built([calibration()]) == built([depth(0)]) == []


stamps_ms = st.integers(0, 300).map(lambda k: 10 * k)
sizes = st.sampled_from([(6, 8), (3, 4)])
observations = st.one_of(
    st.builds(colour, stamps_ms), st.builds(depth, stamps_ms, sizes), st.builds(calibration, stamps_ms)
)
"""At any stamps, late and twice included; depth of two sizes."""


@given(st.lists(observations, max_size=40))
def test_every_colour_image_is_accounted_for_exactly_once(recording):
    done = built(recording)
    frames = [item for item in done if isinstance(item, SyncedFrame)]
    refusals = [item for item in done if isinstance(item, Refusal)]
    got = [item.frame.stamp_ns for item in frames] + [item.stamp_ns for item in refusals if item.leads]
    assert sorted(got) == sorted(item.stamp_ns for item in recording if isinstance(item, ColourImage))
    assert all(item.code for item in refusals)
    # Within a session, frames come in the order of their stamps.
    made = [(item.session, item.frame.stamp_ns) for item in frames]
    assert made == sorted(made)


def test_a_restart_takes_early_stamps_again_keeps_the_calibration_and_counts_sessions_on():
    assembler = FrameAssembler(PAIRING)
    for observation in (calibration(), *pair(5000), *pair(100), *pair(200)):
        assemble(assembler, observation)
    assert assembler.session == 1, "a jump back by almost five seconds"
    assemble(assembler, colour(300))
    assert [one.stamp_ns for one in assembler.restart()] == [START_NS + 300 * MS], "it waited for its depth image"
    made = assemble(assembler, *pair(150), *pair(2000), *pair(200))
    assert summary(made) == [(150, "frame"), (2000, "frame"), (200, "frame")]
    assert [item.session for item in made] == [1, 1, 2]


def test_messages_are_built_with_the_calibration_that_held_when_their_pair_was_certain():
    assembler = FrameAssembler(PAIRING)
    assemble(assembler, calibration())
    (messages,) = [item for observation in pair(0) for item in assembler.synchronize(observation)]
    assemble(assembler, calibration(50, replace(CAMERA, fx_px=9.0)))
    assert isinstance(messages, SyncedMessages)
    built = assembler.build(messages)
    assert built.frame.camera == CAMERA
