# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Masks that the user gives: where they hold nothing is seen, and elsewhere all as before."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from vigg_ros.pipeline import Pipeline
from vigg_ros.registration import Camera, Config, ConfigError, DataError, Frame
from vigg_ros.registration.features import extract
from vigg_ros.registration.options import InputConfig
from vigg_ros.registration.rigid import transform
from vigg_ros.sensors.observation import Calibration, ColourImage, DepthImage
from vigg_ros.tracking.user_mask import UserMask
from vigg_ros_testing.pipeline_runs import run_observations
from vigg_ros_testing.registration_samples import CAMERA, Studio, looking
from vigg_ros_testing.street_samples import along, rigid_frame

BOXES = "0 80 160 120; 10 0 30 20"


def in_boxes(pixels: np.ndarray) -> np.ndarray:
    """Which pixels (K, 2) BOXES hold, to the nearest centre, written out."""
    u, v = np.rint(pixels).T
    return (v >= 80) | ((u >= 10) & (u < 30) & (v < 20))


def test_masked_pixels_yield_no_keypoints_and_no_points(studio: Studio) -> None:
    frame = studio.frame(looking(), 1)
    masked = UserMask(InputConfig(mask_boxes=BOXES)).apply(frame)
    held = in_boxes(CAMERA.project(frame.points()))
    assert 0.3 < held.mean() < 0.5
    np.testing.assert_array_equal(masked.points(), frame.points()[~held])
    keypoints = extract(frame, Config()).keypoints.pixels
    assert in_boxes(keypoints).sum() > 20
    np.testing.assert_array_equal(extract(masked, Config()).keypoints.pixels, keypoints[~in_boxes(keypoints)])
    assert frame.geometry.depth_m[90].any(), "the frame that was given stays as it is"  # type: ignore[union-attr]


def test_a_scan_loses_what_the_camera_sees_of_the_body_and_nothing_else() -> None:
    frame = rigid_frame(along(0.0), seed=1)
    camera, scan = frame.camera, frame.geometry
    frame = replace(frame, geometry=replace(scan, times_s=np.arange(len(scan.points()), dtype=float)))
    masked = UserMask(InputConfig(mask_boxes="0 160 512 256")).apply(frame)
    rows, pixels = scan.visible()  # type: ignore[union-attr]
    held = rows[np.rint(pixels[:, 1]) >= 160]
    assert len(held) > 100
    kept = np.setdiff1d(np.arange(len(scan.points())), held)
    points, times_s = masked.scan_with_times()  # type: ignore[misc]
    np.testing.assert_array_equal(points, scan.points()[kept])
    np.testing.assert_array_equal(times_s, kept)
    corrected = masked.with_points(points + np.float32(0.01))
    edge = np.column_stack((np.arange(0, 512, 4), np.full(128, 161))).astype(float)
    seen = np.isfinite(frame.points_at(edge)).all(axis=1)
    assert seen.any(), "near the edge of the mask pixels would see points beyond it"
    for one in (masked, corrected):
        assert np.isnan(one.points_at(edge)).all()
        assert np.isfinite(one.points_at(edge - (0, 4))).any()
    behind = transform(scan.T_camera_points, points)[:, 2] < 0
    assert behind.any(), "what the camera does not see remains"
    assert camera == masked.camera


def test_an_image_masks_where_it_is_not_0(tmp_path: Path, studio: Studio) -> None:
    drawn = np.zeros((120, 160), np.uint8)
    drawn[80:], drawn[:20, 10:30] = 1, 255
    cv2.imwrite(str(tmp_path / "mask.png"), drawn)
    frame = studio.frame(looking(), 1)
    by_image = UserMask(InputConfig(mask_image=str(tmp_path / "mask.png"))).apply(frame)
    np.testing.assert_array_equal(by_image.points(), UserMask(InputConfig(mask_boxes=BOXES)).apply(frame).points())
    both = UserMask(InputConfig(mask_image=str(tmp_path / "mask.png"), mask_boxes="0 0 160 80")).apply(frame)
    assert len(both.points()) == 0


@pytest.mark.parametrize(
    ("drawn", "found"),
    [
        (None, "no image"),
        (np.zeros((4, 4, 3), np.uint8), r"shape \(4, 4, 3\)"),
        (np.zeros((4, 4), np.uint16), "uint16"),
    ],
)
def test_an_image_that_is_no_mask_stops_the_start(drawn: np.ndarray | None, found: str, tmp_path: Path) -> None:
    path = tmp_path / "mask.png"
    if drawn is not None:
        cv2.imwrite(str(path), drawn)
    with pytest.raises(ConfigError, match=f"input.mask_image: found .*{found}.*, expected an 8-bit image"):
        Pipeline(Config().replace({"input.mask_image": str(path)}))


@pytest.mark.parametrize(
    "boxes", ["1 2 3", "0 0 0 5", "5 5 4 9", "-1 0 4 4", "0 0 4.5 4", "0 0 4 4, 1 1 2 2", "a b c d"]
)
def test_boxes_that_are_none_stop_the_start(boxes: str) -> None:
    with pytest.raises(ConfigError, match=r"input\.mask_boxes holds .* expected x0 y0 x1 y1 in whole pixels"):
        Config().replace({"input.mask_boxes": boxes})


@pytest.mark.parametrize("boxes", ["", " ; ", "0 0 8 6;"])
def test_boxes_may_be_missing_and_reach_the_border(boxes: str) -> None:
    camera = Camera(8, 6, 7.0, 7.0, 3.5, 2.5)
    frame = Frame.from_depth(np.zeros((6, 8), np.uint8), np.ones((6, 8), np.float32), camera)
    assert len(UserMask(InputConfig(mask_boxes=boxes)).apply(frame).points()) == (0 if "8" in boxes else 48)


@pytest.mark.parametrize("size", [(8, 6), (160, 119)])
def test_a_mask_of_another_camera_is_refused(size: tuple[int, int], tmp_path: Path, studio: Studio) -> None:
    cv2.imwrite(str(tmp_path / "mask.png"), np.zeros(size[::-1], np.uint8))
    frame = studio.frame(looking(), 1)
    for config in (InputConfig(mask_image=str(tmp_path / "mask.png")), InputConfig(mask_boxes="0 0 160 121")):
        with pytest.raises(DataError, match="160x120, expected a mask of the camera's size"):
            UserMask(config).apply(frame)


def test_the_pipeline_masks_each_frame_or_refuses_it(studio: Studio) -> None:
    image, depth_m = studio.view(looking())
    observations = [
        Calibration(1, "optical", CAMERA), ColourImage(10**9, "optical", image), DepthImage(10**9, "optical", depth_m),
    ]  # fmt: skip
    (started,) = run_observations(Pipeline(Config().replace({"input.mask_boxes": BOXES})), observations)
    assert started.compared is not None
    assert not started.compared.frame.geometry.depth_m[80:].any()  # type: ignore[union-attr]
    (refused,) = run_observations(Pipeline(Config().replace({"input.mask_boxes": "0 0 161 2"})), observations)
    assert (refused.state.value, refused.reason) == ("REFUSED", "MASK_SIZE")
