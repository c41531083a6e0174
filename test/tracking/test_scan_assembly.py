# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scans and images into frames: the scan leads."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import permutations

import numpy as np
import pytest
from numpy.typing import NDArray

from vigg_ros.bench.worlds.poses import flat
from vigg_ros.registration.options import PairingConfig
from vigg_ros.registration.rigid import inverse, transform
from vigg_ros.sensors.observation import Calibration, ColourImage, Observation, PointCloud
from vigg_ros.tracking.assembly import Assembled, FrameAssembler, Refusal, SyncedFrame
from vigg_ros.tracking.extrinsics import StaticTree, fixed
from vigg_ros_testing.street_samples import CAMERA, T_BASE_CAMERA, T_BASE_LIDAR, T_CAMERA_LIDAR

START_NS = 1_772_013_245_123_456_789
MS = 1_000_000
PAIRING = PairingConfig(sync_slop_s=0.05)


def wall() -> NDArray[np.float32]:
    """Points 10 m before the camera, in the scanner's frame."""
    u, v = np.meshgrid(np.arange(4, CAMERA.width_px, 16), np.arange(4, CAMERA.height_px, 16))
    pixels = np.column_stack((u.ravel(), v.ravel()))
    in_camera = CAMERA.lift(pixels, np.full(len(pixels), 10.0))
    return transform(inverse(T_CAMERA_LIDAR), in_camera).astype(np.float32)


def scan(at_ms: int, **fields: object) -> PointCloud:
    return PointCloud(START_NS + at_ms * MS, "lidar", wall(), **fields)  # type: ignore[arg-type]


def image(at_ms: int, grey: int = 0, *, frame_id: str = "optical") -> ColourImage:
    pixels = np.full((CAMERA.height_px, CAMERA.width_px), grey, np.uint8)
    return ColourImage(START_NS + at_ms * MS, frame_id, pixels)


def calibration(frame_id: str = "optical") -> Calibration:
    return Calibration(START_NS, frame_id, CAMERA)


def car() -> StaticTree:
    tree = StaticTree()
    tree.add("base_link", "lidar", T_BASE_LIDAR)
    tree.add("base_link", "optical", T_BASE_CAMERA)
    return tree


def assemble(observations: Iterable[Observation], tree: StaticTree | None = None) -> list[Assembled]:
    assembler = FrameAssembler(PAIRING, (tree or car()).lookup)
    return [done for item in observations for done in assembler.add(item)] + assembler.flush()


def frames(assembled: list[Assembled]) -> list[SyncedFrame]:
    refused = [item for item in assembled if isinstance(item, Refusal)]
    assert not refused
    return [item for item in assembled if isinstance(item, SyncedFrame)]


def test_a_frame_has_the_stamp_and_the_frame_of_its_scan() -> None:
    (synced,) = frames(assemble([calibration(), image(3, 77), scan(0)]))
    assert synced.frame_id == "lidar"
    assert synced.frame.stamp_ns == START_NS
    assert (synced.frame.image == 77).all()
    np.testing.assert_array_equal(synced.frame.points(), wall())


def test_points_are_seen_through_the_chain_of_static_transforms() -> None:
    (synced,) = frames(assemble([calibration(), image(0), scan(0)]))
    # The wall was made of these pixels; float32 metres at 10 m are good for 0.0001 px.
    np.testing.assert_allclose(synced.frame.points_at(np.array([[20.0, 36.0]])), wall()[[2 * 32 + 1]], atol=0)


def test_times_of_points_come_along() -> None:
    times_s = np.linspace(-0.05, 0.05, len(wall()))
    (synced,) = frames(assemble([calibration(), image(0), scan(0, times_s=times_s)]))
    kept = synced.frame.scan_with_times()
    assert kept is not None
    np.testing.assert_array_equal(kept[1], times_s)


def test_a_camera_faster_than_the_scanner_gives_each_scan_its_nearest_image() -> None:
    """30 Hz and 10 Hz, a third of a period apart: images at 33 k + 11 ms, grey value k."""
    images = [image(33 * k + 11, k) for k in range(31)]
    scans = [scan(100 * k) for k in range(1, 10)]
    stream: list[Observation] = [calibration(), *sorted([*images, *scans], key=lambda item: item.stamp_ns)]
    found = frames(assemble(stream))
    assert [item.frame.stamp_ns for item in found] == [item.stamp_ns for item in scans]
    nearest = [min(range(31), key=lambda k: abs(33 * k + 11 - at_ms)) for at_ms in range(100, 1000, 100)]
    assert [int(item.frame.image[0, 0]) for item in found] == nearest


def test_a_scanner_faster_than_the_camera_accounts_for_each_scan_once() -> None:
    """20 Hz and 10 Hz: every second scan has an image of its own, the others none."""
    stream = sorted([*(scan(50 * k) for k in range(9)), *(image(100 * k) for k in range(5))], key=lambda o: o.stamp_ns)
    done = assemble([calibration(), *stream])
    stamps = [item.frame.stamp_ns if isinstance(item, SyncedFrame) else item.stamp_ns for item in done]
    assert stamps == [START_NS + 50 * k * MS for k in range(9)]
    assert [isinstance(item, SyncedFrame) for item in done] == [k % 2 == 0 for k in range(9)]
    assert {item.code for item in done if isinstance(item, Refusal)} == {"UNPAIRED"}


def test_the_order_of_arrival_does_not_change_the_frames() -> None:
    scans, images = [scan(0), scan(100)], [image(4, 1), image(96, 2)]
    orders = [order for order in permutations([*scans, *images]) if in_order(order, scans) and in_order(order, images)]
    assert len(orders) == 6
    for order in orders:
        found = frames(assemble([calibration(), *order]))
        assert [(item.frame.stamp_ns, int(item.frame.image[0, 0])) for item in found] == [
            (START_NS, 1),
            (START_NS + 100 * MS, 2),
        ]


def in_order(order: Sequence[object], part: Sequence[object]) -> bool:
    """Messages of one topic do not overtake each other."""
    return [item for item in order if any(item is one for one in part)] == list(part)


def test_scans_wait_for_the_first_calibration() -> None:
    (synced,) = frames(assemble([scan(0), image(0), calibration()]))
    assert synced.frame.stamp_ns == START_NS


def test_without_a_chain_of_transforms_a_scan_is_refused_by_name() -> None:
    tree = StaticTree()
    tree.add("base_link", "lidar", T_BASE_LIDAR)
    (refusal,) = assemble([calibration(), image(0), scan(0)], tree)
    assert isinstance(refusal, Refusal)
    assert (refusal.code, refusal.stamp_ns) == ("NO_TF", START_NS)
    assert "'lidar' to 'optical'" in refusal.message
    assert "/tf_static" in refusal.message


def test_transforms_that_come_later_serve_the_scans_after_them() -> None:
    tree = StaticTree()
    assembler = FrameAssembler(PAIRING, tree.lookup)
    assembler.add(calibration())
    assembler.add(image(0))
    (refusal,) = assembler.add(scan(0))
    assert isinstance(refusal, Refusal)
    tree.add("lidar", "optical", inverse(T_CAMERA_LIDAR))
    assembler.add(image(100))
    (synced,) = assembler.add(scan(100))
    assert isinstance(synced, SyncedFrame)


def test_an_image_without_a_frame_takes_that_of_its_calibration() -> None:
    (synced,) = frames(assemble([calibration("optical"), image(0, frame_id=""), scan(0)]))
    np.testing.assert_allclose(synced.frame.geometry.T_camera_points, T_CAMERA_LIDAR, atol=1e-14)


def test_extrinsics_of_the_user_serve_whatever_the_frames_are_called() -> None:
    assembler = FrameAssembler(PAIRING, fixed(T_CAMERA_LIDAR))
    done = [*assembler.add(calibration("")), *assembler.add(image(0, frame_id="")), *assembler.add(scan(0))]
    np.testing.assert_array_equal(frames(done)[0].frame.geometry.T_camera_points, T_CAMERA_LIDAR)


@pytest.mark.parametrize(
    ("observations", "code", "says"),
    [
        ([image(0), scan(0)], "NO_CALIBRATION", "CameraInfo"),
        ([calibration(), scan(0)], "UNPAIRED", "colour image"),
        ([calibration(), image(51), scan(0)], "UNPAIRED", "colour image"),
    ],
    ids=["no calibration", "no image", "image beyond the slop"],
)
def test_a_scan_without_its_company_is_refused(observations: list[Observation], code: str, says: str) -> None:
    (refusal,) = assemble(observations)
    assert isinstance(refusal, Refusal)
    assert (refusal.code, refusal.stamp_ns) == (code, START_NS)
    assert says in refusal.message


def test_wrong_extrinsics_refuse_the_scan_and_no_more() -> None:
    tree = StaticTree()
    tree.add("optical", "lidar", flat((0.0, 0.0, -30.0)))
    done = assemble([calibration(), image(0), scan(0)], tree)
    assert [item.code for item in done if isinstance(item, Refusal)] == ["NO_DEPTH"]


def test_images_without_a_scan_leave_no_trace() -> None:
    assert assemble([calibration(), *(image(33 * k) for k in range(40))]) == []
