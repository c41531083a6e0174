# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Sound messages of scenes without information, through the replay: no pose, a reason, and the next frame works."""

import numpy as np
import pytest

from vigg_ros.bags.decoding import message_types
from vigg_ros.messages.fields import ROSBAGS, build
from vigg_ros.messages.pose_messages import encode_pose
from vigg_ros.pipeline import Pipeline
from vigg_ros.registration.camera import Camera
from vigg_ros.registration.config import Config
from vigg_ros.registration.result import Reason, Rejection
from vigg_ros.registration.vigg import extract, register
from vigg_ros.report.recording import Replay
from vigg_ros.sensors.observation import Calibration, ColourImage, DepthImage, PointCloud
from vigg_ros.tracking.assembly import scan_frame
from vigg_ros.tracking.extrinsics import StaticTree
from vigg_ros_testing.pipeline_runs import run_observations

START_NS = 1_700_000_000_123_456_789
PERIOD_NS = 100_000_000
CONFIG = Config.preset("rgbd")


def camera(width, height):
    return Camera(width, height, fx_px=200.0, fy_px=200.0, cx_px=(width - 1) / 2, cy_px=(height - 1) / 2)


def textured(width=160, height=120):
    return np.random.default_rng(3).integers(0, 256, (height, width, 3), dtype=np.uint8)


def corner(width, height):
    """Depth (H, W) of a wall with a step: surfaces in no single plane."""
    depth_m = np.full((height, width), 2.0, np.float32)
    depth_m[:, width // 2 :] = 2.5
    return depth_m


def run(images):
    """The replay of these images, all of one size, in front of the same walls."""
    height, width = images[0].shape[:2]
    observations = [Calibration(START_NS, "camera", camera(width, height))]
    for number, image in enumerate(images):
        stamp_ns = START_NS + number * PERIOD_NS
        observations += [ColourImage(stamp_ns, "camera", image), DepthImage(stamp_ns, "camera", corner(width, height))]
    return run_observations(Pipeline(CONFIG), observations)


@pytest.mark.hostile("Image: constant, black, saturated, 1x1, 8x8: NO_TEXTURE")
@pytest.mark.parametrize(
    ("images", "expected"),
    [
        *(([np.full((120, 160, 3), level, np.uint8), textured()], ["NO_TEXTURE", ""]) for level in (0, 128, 255)),
        *(([textured(side, side)], ["NO_TEXTURE"]) for side in (1, 8)),
    ],
)
def test_an_image_that_shows_nothing_starts_nothing_and_the_next_one_does(images, expected):
    records = run(images)
    assert [record.reason for record in records] == expected
    assert [record.state for record in records] == ["STARTED" if reason == "" else "LOST" for reason in expected]
    assert (records[0].T_odom_frame, records[0].covariance) == (None, None)


def line():
    return np.column_stack((np.linspace(-0.5, 0.5, 3000), np.zeros(3000), np.full(3000, 2.0)))


def plane():
    x, y = np.meshgrid(np.linspace(-0.7, 0.7, 60), np.linspace(-0.5, 0.5, 50))
    return np.column_stack((x.ravel(), y.ravel(), np.full(x.size, 2.0)))


CLOUDS = {"identical": np.tile([0.0, 0.0, 2.0], (3000, 1)), "collinear": line(), "coplanar": plane()}


def register_with_itself(points, image):
    scan = PointCloud(START_NS, "camera", points.astype(np.float32))
    colour, calibration = ColourImage(START_NS, "camera", image), Calibration(START_NS, "camera", camera(160, 120))
    features = extract(scan_frame(scan, colour, calibration, StaticTree().lookup), CONFIG)
    return register(features, features, CONFIG)


@pytest.mark.hostile("PointCloud2: identical, collinear or coplanar points DEGENERATE")
@pytest.mark.parametrize("kind", CLOUDS)
def test_points_that_fix_no_motion_give_none(kind):
    # A plane with texture does fix a motion; without, it slides.
    image = np.full((120, 160, 3), 128, np.uint8) if kind == "coplanar" else textured()
    outcome = register_with_itself(CLOUDS[kind], image)
    assert isinstance(outcome, Rejection)
    # Points on one spot or line are too few once thinned to voxels, before their shape is looked at.
    assert outcome.reason in (Reason.DEGENERATE, Reason.NO_DEPTH, Reason.NO_TEXTURE)


def test_a_plane_with_texture_fixes_the_motion():
    outcome = register_with_itself(CLOUDS["coplanar"], textured())
    np.testing.assert_allclose(outcome.T_target_source, np.eye(4), atol=1e-9)  # the same frame twice


def test_what_is_odd_about_the_truth_is_noted():
    encoded = encode_pose(np.eye(4), stamp_ns=START_NS, frame_id="/map")
    message = build(encoded, message_types().types.__getitem__, ROSBAGS)
    replay = Replay(pipeline := Pipeline(CONFIG))
    assert list(replay.run([("ground_truth", message)])) == []
    assert [pose.frame_id for pose in replay.truth] == ["map"]
    assert [*pipeline.notes] == [("ground_truth", "FRAME_ID_SLASH")]
