# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Results and recordings as a replay leaves them, without the work of a replay."""

from collections import Counter
from functools import cache

import numpy as np

from vigg_ros.registration import Camera, Config, Evidence, Frame, Reason, Registration, Rejection
from vigg_ros.registration.features import Features
from vigg_ros.registration.geometric import Surface
from vigg_ros.registration.noise import NO_NOISE
from vigg_ros.registration.options import VisualConfig
from vigg_ros.registration.visual import detect
from vigg_ros.report.recording import LEADING_MESSAGES, Recording
from vigg_ros.sensors.observation import StampedPose
from vigg_ros.tracking.chain import UncertainPose
from vigg_ros.tracking.frame_result import Comparison, FrameResult, State
from vigg_ros.tracking.keyframes import Keyframe

START_NS = 1_700_000_000_000_000_000
FRAME_NS = 100_000_000
CAMERA = Camera(width_px=128, height_px=96, fx_px=120.0, fy_px=120.0, cx_px=63.5, cy_px=47.5)
TIMINGS_MS = {"keypoints": 20.0, "features": 30.0, "verification": 5.0}


def pose_at(i):
    """On a bend, so that positions determine the alignment."""
    T = np.eye(4)
    T[:3, 3] = 0.1 * i, 0.02 * np.sin(i), 0.01 * i * i
    return T


def stamp(i):
    return START_NS + i * FRAME_NS


@cache
def seen():
    """Image and keypoints of every frame: all show the same, so that matches join equal pixels."""
    image = np.random.default_rng(0).integers(0, 256, (96, 128, 3), np.uint8)
    keypoints = detect(_frame(image, 0), VisualConfig())
    assert len(keypoints) > 20
    return image, keypoints


def _frame(image, i):
    return Frame.from_depth(image, np.full((96, 128), 2.0, np.float32), CAMERA, stamp_ns=stamp(i))


def frame(i=0):
    """A frame and its features."""
    image, keypoints = seen()
    made = _frame(image.copy(), i)
    points = keypoints.points.astype(np.float32)
    surface = Surface(points, np.tile(np.float32([0, 0, -1]), (len(points), 1)))
    return made, Features(made, Config(), keypoints, surface, surface, made.geometry.view(), NO_NOISE, None)


def compared(i=0, *, with_keyframe=True):
    keyframe = Keyframe(7, *frame(), UncertainPose.identity(), np.zeros(6)) if with_keyframe else None
    return Comparison(*frame(i), keyframe)


def _result(i, state, **fields):
    usual = {"stamp_ns": stamp(i), "state": state, "keyframe_id": 7, "timings_ms": dict(TIMINGS_MS), "session": 0}
    return FrameResult(**{**usual, "frame_id": "camera", **fields})


def started(i=0, **fields):
    fields = {"T_odom_frame": pose_at(i), "covariance": np.zeros((6, 6)), "new_keyframe": True, **fields}
    return _result(i, State.STARTED, **fields)


def tracked(i, *, state=State.TRACKING, **fields):
    """Fields of the evidence may be given too."""
    usual = {"visual_matches": 20, "visual_inliers": 12, "geometric_matches": 200, "geometric_inliers": 90}
    usual |= {"rmse_m": 0.004, "overlap": 0.8, "consistency": 0.95, "conflict": 0.0, "lead_log10": 3e4}
    usual |= {"photometric_correlation": float("nan")}
    usual |= {"visual_log10_nfa": -40.0, "log10_nfa": -3e4, "match_log10_p": -3e4}
    usual |= {"surface_pairs": 4000, "motion_sigma_m": 0.001, "motion_sigma_deg": 0.05}
    evidence = Evidence(**{name: fields.pop(name, value) for name, value in usual.items()})
    pixels = seen()[1].pixels[:12]
    inliers = np.hstack((pixels, pixels))
    outcome = Registration(np.eye(4), 1e-6 * np.eye(6), evidence, inliers)
    fields = {"T_odom_frame": pose_at(i), "covariance": 1e-6 * np.eye(6), "outcome": outcome, **fields}
    return _result(i, state, **fields)


def lost(i, reason=Reason.CONFLICT, message="40.0% coincides, expected 60.0%", **fields):
    outcome = Rejection(reason, message, Evidence(keypoints=20, visual_matches=20))
    return _result(i, State.LOST, reason=reason.value, message=message, outcome=outcome, **fields)


def refused(i, code="DEPTH_SIZE", message="depth of another size", *, stamp_ns=None, session=0):
    return FrameResult(stamp(i) if stamp_ns is None else stamp_ns, session, State.REFUSED, code, message)


def truth(count):
    """The poses themselves, in a world that is moved against the odometry frame."""
    T_map_odom = np.eye(4)
    T_map_odom[:3, 3] = 5.0, -3.0, 1.0
    return [StampedPose(stamp(i), "map", "camera", T_map_odom @ pose_at(i)) for i in range(count)]


def recording(results, *, truth=(), name="walk", refused=(), notes=(), leaders=LEADING_MESSAGES["image"]):
    """Of results, those of refused inputs among them."""
    return Recording(name, list(results), list(truth), Counter(dict(refused)), list(notes), leaders)
