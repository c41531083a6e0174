# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scans and images into frames: the scan leads."""

import re
from dataclasses import replace

import numpy as np
import pytest

from vigg_ros.bench.worlds.poses import flat
from vigg_ros.registration.options import PairingConfig
from vigg_ros.registration.rigid import inverse, transform
from vigg_ros.sensors.observation import Calibration, ColourImage, PointCloud
from vigg_ros.tracking.assembly import FrameAssembler, Refusal, SyncedFrame
from vigg_ros.tracking.extrinsics import StaticTree, fixed
from vigg_ros_testing.pipeline_runs import assemble
from vigg_ros_testing.street_samples import CAMERA, T_BASE_CAMERA, T_BASE_LIDAR, T_CAMERA_LIDAR

START_NS = 1_772_013_245_123_456_789
MS = 1_000_000
PAIRING = PairingConfig(sync_slop_s=0.05)


def wall():
    """Points 10 m before the camera, in the scanner's frame."""
    u, v = np.meshgrid(np.arange(4, CAMERA.width_px, 16), np.arange(4, CAMERA.height_px, 16))
    pixels = np.column_stack((u.ravel(), v.ravel()))
    in_camera = CAMERA.lift(pixels, np.full(len(pixels), 10.0))
    return transform(inverse(T_CAMERA_LIDAR), in_camera).astype(np.float32)


def scan(at_ms, **fields):
    return PointCloud(START_NS + at_ms * MS, "lidar", wall(), **fields)


def image(at_ms, grey=0, *, frame_id="optical"):
    pixels = np.full((CAMERA.height_px, CAMERA.width_px), grey, np.uint8)
    return ColourImage(START_NS + at_ms * MS, frame_id, pixels)


def calibration(frame_id="optical"):
    return Calibration(START_NS, frame_id, CAMERA)


def linked(*links):
    tree = StaticTree()
    for link in links:
        tree.add(*link)
    return tree


CAR = linked(("base_link", "lidar", T_BASE_LIDAR), ("base_link", "optical", T_BASE_CAMERA))


def built(observations, tree=CAR, config=PAIRING):
    assembler = FrameAssembler(config, tree.lookup)
    return assemble(assembler, *observations, end=True)


def frames(assembled):
    refused = [item for item in assembled if isinstance(item, Refusal)]
    assert not refused
    return [item for item in assembled if isinstance(item, SyncedFrame)]


def test_a_frame_has_the_stamp_the_frame_and_the_times_of_its_scan():
    times_s = np.linspace(-0.05, 0.05, len(wall()))
    (synced,) = frames(built([calibration(), image(3, 77), scan(0, times_s=times_s)]))
    assert synced.frame_id == "lidar"
    assert (synced.frame.stamp_ns, synced.frame.apart_s) == (START_NS, 0.003)
    assert (synced.frame.image == 77).all()
    np.testing.assert_array_equal(synced.frame.points(), wall())
    np.testing.assert_array_equal(synced.frame.scan_with_times()[1], times_s)


def test_points_are_seen_through_the_chain_of_static_transforms():
    (synced,) = frames(built([calibration(), image(0), scan(0)]))
    # The wall was made of these pixels; float32 metres at 10 m are good for 0.0001 px.
    np.testing.assert_allclose(synced.frame.points_at(np.array([[20.0, 36.0]])), wall()[[2 * 32 + 1]], atol=0)


def test_a_camera_faster_than_the_scanner_gives_each_scan_its_nearest_image():
    """30 Hz and 10 Hz, a third of a period apart: images at 33 k + 11 ms, grey value k."""
    images = [image(33 * k + 11, k) for k in range(31)]
    scans = [scan(100 * k) for k in range(1, 10)]
    stream = [calibration(), *sorted([*images, *scans], key=lambda item: item.stamp_ns)]
    found = frames(built(stream))
    assert [item.frame.stamp_ns for item in found] == [item.stamp_ns for item in scans]
    nearest = [min(range(31), key=lambda k: abs(33 * k + 11 - at_ms)) for at_ms in range(100, 1000, 100)]
    assert [int(item.frame.image[0, 0]) for item in found] == nearest


@pytest.mark.parametrize("reuse", [False, True])
def test_a_scanner_faster_than_the_camera_accounts_for_each_scan_once(reuse):
    """20 Hz and 10 Hz: every second scan has an image of its own, the others none, or the earlier of two as near."""
    images = [image(100 * k, k) for k in range(5)]
    stream = sorted([*(scan(50 * k) for k in range(9)), *images], key=lambda item: item.stamp_ns)
    done = built([calibration(), *stream], config=replace(PAIRING, reuse_depth=reuse))
    grey = [int(item.frame.image[0, 0]) if isinstance(item, SyncedFrame) else item.code for item in done]
    assert grey == [k // 2 if k % 2 == 0 or reuse else "UNPAIRED" for k in range(9)]


def test_transforms_that_come_later_serve_the_scans_after_them():
    tree = StaticTree()
    assembler = FrameAssembler(PAIRING, tree.lookup)
    (refusal,) = assemble(assembler, calibration(), image(0), scan(0))
    assert refusal.code == "NO_TF"
    tree.add("lidar", "optical", inverse(T_CAMERA_LIDAR))
    (synced,) = assemble(assembler, image(100), scan(100))
    assert isinstance(synced, SyncedFrame)


def test_an_image_without_a_frame_takes_that_of_its_calibration():
    (synced,) = frames(built([calibration("optical"), image(0, frame_id=""), scan(0)]))
    np.testing.assert_allclose(synced.frame.geometry.T_camera_points, T_CAMERA_LIDAR, atol=1e-14)


def test_extrinsics_of_the_user_serve_whatever_the_frames_are_called():
    assembler = FrameAssembler(PAIRING, fixed(T_CAMERA_LIDAR))
    done = assemble(assembler, calibration(""), image(0, frame_id=""), scan(0))
    np.testing.assert_array_equal(frames(done)[0].frame.geometry.T_camera_points, T_CAMERA_LIDAR)


COMPLETE = [calibration(), image(0), scan(0)]
OFF_THE_ROAD = linked(("optical", "lidar", flat((0.0, 0.0, -30.0))))


@pytest.mark.parametrize(
    ("observations", "tree", "code", "says"),
    [
        ([image(0), scan(0)], CAR, "NO_CALIBRATION", "CameraInfo"),
        ([calibration(), scan(0)], CAR, "UNPAIRED", "colour image"),
        ([calibration(), image(51), scan(0)], CAR, "UNPAIRED", "colour image"),
        pytest.param(
            COMPLETE,
            linked(("base_link", "lidar", T_BASE_LIDAR)),
            "NO_TF",
            "'lidar' to 'optical'.*/tf_static",
            marks=pytest.mark.hostile("Frames and TF: a link that never comes: NO_TF, never identity"),
        ),
        (COMPLETE, OFF_THE_ROAD, "NO_DEPTH", ""),
    ],
    ids=["no calibration", "no image", "image beyond the slop", "no transform", "wrong extrinsics"],
)
def test_a_scan_without_its_company_is_refused(observations, tree, code, says):
    (refusal,) = built(observations, tree)
    assert (refusal.code, refusal.stamp_ns) == (code, START_NS)
    assert re.search(says, refusal.message)


def test_images_without_a_scan_leave_no_trace():
    assert built([calibration(), *(image(33 * k) for k in range(40))]) == []
