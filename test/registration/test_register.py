# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Two looks at a rendered room: the motion between them is known, and so is the noise."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy import stats

from vigg_ros.bench.worlds import Light, Scene, render_rgbd
from vigg_ros.bench.worlds.poses import Pose, look_at
from vigg_ros.bench.worlds.surfaces import Sphere
from vigg_ros.registration import Config, Evidence, Frame, Registration, extract, register
from vigg_ros.registration.stages import record_stages
from vigg_ros_testing.registration_samples import (
    CAMERA,
    Studio,
    answer,
    error_vector,
    errors,
    looking,
    motion,
    noisy,
)

CONFIG = Config()

PAIRS: dict[str, tuple[Pose, Pose]] = {
    "a step": (looking(), looking((0.1, 0.1, 0))),
    "closer": (looking(), looking((0.4, 0, -0.1))),
    "a step aside": (looking(), looking((0, 0.5, 0), (0, 0.2, 0))),
    "a look aside": (looking(), looking((0, 0, 0), (0.2, 0.8, -0.1))),
    "a head tilted": (looking(), looking((0, 0, 0), (0, 0, 0), 30)),
    "all at once": (looking((0.2, -0.3, 0)), looking((-0.1, 0.2, -0.3), (0.2, 0.3, 0), -12)),
}
REFUSED = 99.99
"""Per cent of chi2(6) beyond which an error is not one that the covariance knows of."""


def truth(target: Pose, source: Pose) -> Pose:
    return np.linalg.inv(target) @ source


def assert_within_noise(outcome: object, T_true: Pose) -> Registration:
    """Right, to a degree that does not depend on the method, and as exact as the answer itself claims."""
    found = answer(outcome)
    rotation_deg, translation_m = errors(found.T_target_source, T_true)
    # A pixel is 0.4 deg wide and depth is off by 13 mm at 3 m. Some hundred independent patches leave a
    # tenth of that; what they see of the room is 3 m away, which turns 0.1 deg into 5 mm.
    assert rotation_deg < 0.5
    assert translation_m < 0.015
    vector = error_vector(found.T_target_source, T_true)
    normalised = float(vector @ np.linalg.solve(found.covariance, vector))
    assert normalised < stats.chi2(6).ppf(REFUSED / 100)
    return found


@pytest.mark.parametrize("pair", PAIRS.values(), ids=PAIRS)
def test_the_motion_is_found_within_what_the_noise_explains(pair: tuple[Pose, Pose], studio: Studio) -> None:
    target, source = pair
    outcome = register(studio.features(target, 1), studio.features(source, 2), CONFIG)
    found = assert_within_noise(outcome, truth(target, source))
    np.testing.assert_allclose(found.covariance, found.covariance.T)
    assert np.linalg.eigvalsh(found.covariance).min() > 0
    np.testing.assert_allclose(found.T_target_source[:3, :3] @ found.T_target_source[:3, :3].T, np.eye(3), atol=1e-9)


def test_without_noise_the_motion_is_found_to_a_fraction_of_a_millimetre(studio: Studio) -> None:
    """What is left is the voxel grid, which cuts the same surfaces elsewhere in the two frames."""
    target, source = PAIRS["all at once"]
    found = answer(register(studio.features(target), studio.features(source), CONFIG))
    rotation_deg, translation_m = errors(found.T_target_source, truth(target, source))
    assert rotation_deg < 0.02
    assert translation_m < 0.001


@pytest.mark.parametrize("name", ["a step", "a look aside", "all at once"])
def test_swapping_source_and_target_inverts_the_answer(name: str, studio: Studio) -> None:
    """Not to the digit: each direction samples its own source, and pairs it with the other's surface."""
    target, source = (studio.features(pose, seed) for seed, pose in enumerate(PAIRS[name]))
    there, back = (answer(register(*pair, CONFIG)) for pair in ((target, source), (source, target)))
    left = error_vector(back.T_target_source @ there.T_target_source, np.eye(4))
    # Both made their error from the same noise; each alone would leave its own deviation.
    np.testing.assert_array_less(np.abs(left), 3 * np.sqrt(np.diag(there.covariance)))
    assert np.linalg.norm(there.T_target_source[:3, 3]) > 10 * np.linalg.norm(left[:3]) or name == "a look aside"


def test_moving_the_world_leaves_the_answer(studio: Studio) -> None:
    """The room turned and shifted, the camera with it. Balls stay out: their paint does not turn with them."""
    T_new_old = motion((20, -50, 130), (5, -3, 2))
    old = Scene(tuple(s for s in studio.scene.surfaces if not isinstance(s, Sphere)), studio.scene.light)
    lamp = T_new_old @ (*old.light.position, 1)
    new = Scene(
        tuple(replace(s, T_world_surface=T_new_old @ s.T_world_surface) for s in old.surfaces),  # type: ignore[type-var]
        Light(tuple(lamp[:3]), old.light.ambient),
    )
    poses = PAIRS["a step"]
    found = []
    for scene, T in ((old, np.eye(4)), (new, T_new_old)):
        frames = [noisy(*render_rgbd(scene, CAMERA, T @ pose), seed=i) for i, pose in enumerate(poses)]
        found.append(answer(register(extract(frames[0], CONFIG), extract(frames[1], CONFIG), CONFIG)))
    rotation_deg, translation_m = errors(found[1].T_target_source, found[0].T_target_source)
    # Rays differ by 1e-15, which may round a grey level or two to the other side, and move a keypoint.
    assert rotation_deg < 0.01
    assert translation_m < 0.0005


def as_bytes(outcome: object) -> tuple[bytes, ...]:
    found = answer(outcome)
    return (
        found.T_target_source.tobytes(),
        found.covariance.tobytes(),
        found.visual_inliers_px.tobytes(),
        repr(found.evidence).encode(),
    )


def test_the_same_frames_give_the_same_bytes(studio: Studio) -> None:
    """Also with another number of threads: OpenCV finds keypoints in parallel."""
    target, source = PAIRS["all at once"]
    threads = cv2.getNumThreads()
    outcomes = []
    try:
        for count in (1, 1, 4):
            cv2.setNumThreads(count)
            frames = studio.frame(target, 1), studio.frame(source, 2)
            outcomes.append(as_bytes(register(*(extract(frame, CONFIG) for frame in frames), CONFIG)))
    finally:
        cv2.setNumThreads(threads)
    assert outcomes[0] == outcomes[1] == outcomes[2]


def test_register_leaves_the_features_as_they_are(studio: Studio) -> None:
    """A keyframe's features serve many frames."""
    target, source = (extract(studio.frame(pose, 5), CONFIG) for pose in PAIRS["a step"])
    first = as_bytes(register(target, source, CONFIG))
    register(source, target, CONFIG)
    assert as_bytes(register(target, source, CONFIG)) == first


def test_another_seed_samples_other_points_and_finds_the_same_motion(studio: Studio) -> None:
    target, source = PAIRS["all at once"]
    features = studio.features(target, 1), studio.features(source, 2)
    one, other = (
        answer(register(*features, CONFIG.replace({"seed": seed, "geometric.sample_k": 2000}))) for seed in (0, 1)
    )
    assert as_bytes(one) != as_bytes(other)
    assert_within_noise(other, truth(target, source))


def test_the_evidence_counts_what_the_answer_shows(studio: Studio) -> None:
    target, source = (studio.features(pose, seed) for seed, pose in enumerate(PAIRS["all at once"]))
    found = answer(register(target, source, CONFIG))
    evidence = found.evidence
    assert evidence.keypoints == len(source.keypoints)
    assert evidence.visual_inliers == len(found.visual_inliers_px)
    rows_target, rows_source = (
        [seen.keypoints.pixels.tolist().index(pixel) for pixel in pixels.tolist()]
        for seen, pixels in ((target, found.visual_inliers_px[:, :2]), (source, found.visual_inliers_px[:, 2:]))
    )
    moved = source.keypoints.points[rows_source] @ found.T_target_source[:3, :3].T + found.T_target_source[:3, 3]
    off_m = np.linalg.norm(moved - target.keypoints.points[rows_target], axis=1)
    assert off_m.max() < CONFIG.cliques.inlier_threshold_m
    assert evidence.visual_inliers <= evidence.visual_matches <= CONFIG.visual.top_k
    assert 0 < evidence.overlap < evidence.consistency <= 1
    assert evidence.hypotheses >= evidence.candidates >= 1
    # Surfaces of Kinect noise at 2 to 3 m, both together: about 1 cm.
    assert 0.002 < evidence.rmse_m < 0.03


def test_every_stage_is_timed(studio: Studio) -> None:
    target, source = (studio.frame(pose, 1) for pose in PAIRS["a step"])
    with record_stages() as timings_ms:
        paper = CONFIG.replace({"geometric.always": True})
        register(extract(target, paper), extract(source, paper), paper)
    assert {
        "surface", "features", "keypoints", "visual matches", "global matches", "cliques", "local matches",
        "refinement", "verification",
    } <= set(timings_ms)


@pytest.mark.parametrize("preset", ["rgbd", "rgbd_paper"])
def test_presets_find_the_motion(preset: str, studio: Studio) -> None:
    config = Config.preset(preset)
    target, source = PAIRS["a step"]
    frames = studio.frame(target, 1), studio.frame(source, 2)
    found = answer(register(*(extract(frame, config) for frame in frames), config))
    rotation_deg, translation_m = errors(found.T_target_source, truth(target, source))
    # The paper's method stops at correspondences of a voxel grid: 2.5 cm, less the mean over thousands.
    assert rotation_deg < (0.5 if preset == "rgbd" else 2.0)
    assert translation_m < (0.015 if preset == "rgbd" else 0.05)


def test_orb_serves_in_the_place_of_sift(studio: Studio) -> None:
    config = CONFIG.replace({"visual.detector": "orb"})
    target, source = PAIRS["a step"]
    frames = studio.frame(target, 1), studio.frame(source, 2)
    found = answer(register(*(extract(frame, config) for frame in frames), config))
    assert found.evidence.visual_inliers >= 8
    assert_within_noise(found, truth(target, source))


def test_shapes_answer_where_the_images_hardly_share_a_view(studio: Studio) -> None:
    """Turned by 42 deg of 60: a dozen keypoints are left, and a third of the surface."""
    target, source = (
        look_at((-0.6, 0, 1.4), (-0.6 + np.cos(angle), np.sin(angle), 1.15)) for angle in np.deg2rad((106, 148))
    )
    found = answer(register(studio.features(target, 118), studio.features(source, 124), CONFIG))
    assert found.evidence.visual_inliers < 20 < found.evidence.geometric_inliers
    rotation_deg, translation_m = errors(found.T_target_source, truth(target, source))
    # Less surface to average over, and all of it at one side of the view.
    assert rotation_deg < 1.0
    assert translation_m < 0.03


@pytest.mark.hostile("Scene: pure rotation A")
@pytest.mark.parametrize("roll_deg", [0, 5, 60])
def test_a_pure_rotation_is_accepted(roll_deg: float, studio: Studio) -> None:
    target, source = looking(), looking((0, 0, 0), (0, 0.4, -0.1), roll_deg)
    outcome = register(studio.features(target, 1), studio.features(source, 2), CONFIG)
    assert_within_noise(outcome, truth(target, source))


NO_MOTION_ROW = pytest.mark.hostile("Scene: no motion A, covariance not 0")


@NO_MOTION_ROW
def test_no_motion_is_accepted(studio: Studio) -> None:
    outcome = register(studio.features(looking(), 1), studio.features(looking(), 2), CONFIG)
    found = assert_within_noise(outcome, np.eye(4))
    assert found.evidence.overlap > 0.9


@NO_MOTION_ROW
def test_the_same_frame_again_is_not_known_to_be_in_the_same_place_exactly(studio: Studio) -> None:
    """A frozen camera, or a simulated one at rest, sends equal frames; a covariance of 0 breaks any filter."""
    for seed in (None, 1):
        features = studio.features(looking(), seed)
        found = answer(register(features, features, CONFIG))
        np.testing.assert_allclose(found.T_target_source, np.eye(4), atol=1e-6)
        deviation = np.sqrt(np.linalg.eigvalsh(found.covariance))
        # A grid of 2.5 cm does not tell a place to a micrometre, and does to some millimetres.
        assert 1e-6 < deviation.min() < deviation.max() < 5e-3


@pytest.mark.hostile("Scene: exposure jump, blur")
@pytest.mark.parametrize("gain", [0.4, 0.7, 1.5, 2.2])
def test_a_jump_of_the_exposure_is_no_motion(gain: float, studio: Studio) -> None:
    target, source = PAIRS["a step"]
    frame = studio.frame(source, 2, gain=gain)
    assert_within_noise(register(studio.features(target, 1), extract(frame, CONFIG), CONFIG), truth(target, source))


@pytest.mark.hostile("Scene: exposure jump, blur")
@pytest.mark.parametrize("width_px", [3, 5, 9])
def test_a_blurred_image_is_still_registered(width_px: int, studio: Studio) -> None:
    """Along x, as a pan of the camera does it; nine pixels of 160 are 3 deg in one exposure."""
    target, source = PAIRS["a step"]
    image, depth_m = studio.view(source)
    frame = noisy(cv2.blur(image, (width_px, 1)), depth_m, seed=2)
    assert_within_noise(register(studio.features(target, 1), extract(frame, CONFIG), CONFIG), truth(target, source))


def test_a_single_textured_wall_is_determined_by_its_visual_matches(wall: Studio) -> None:
    target, source = looking((0.8, 0, 0)), looking((0.9, -0.1, 0))
    found = answer(register(wall.features(target, 1), wall.features(source, 2), CONFIG))
    assert_within_noise(found, truth(target, source))


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_holes_in_the_depth_leave_the_rest(share: float, studio: Studio) -> None:
    """Blocks of 10 pixels without depth, others in each frame, as on glass and black things."""
    rng = np.random.default_rng(0)
    target, source = PAIRS["a step"]

    def holed(pose: Pose, seed: int) -> Frame:
        image, depth_m = studio.view(pose)
        lost = np.kron(rng.random((12, 16)) < share, np.ones((10, 10), bool))
        return noisy(image, np.where(lost, 0, depth_m), seed=seed)

    frames = holed(target, 1), holed(source, 2)
    found = answer(register(*(extract(frame, CONFIG) for frame in frames), CONFIG))
    rotation_deg, translation_m = errors(found.T_target_source, truth(target, source))
    # As within noise, with as much less of the room to average over as both frames leave.
    assert rotation_deg < 0.5 / (1 - share)
    assert translation_m < 0.015 / (1 - share)


def test_evidence_that_was_not_reached_is_empty() -> None:
    evidence = Evidence()
    assert (evidence.visual_inliers, evidence.candidates) == (0, 0)
    assert np.isnan([evidence.overlap, evidence.consistency, evidence.runner_up, evidence.rmse_m]).all()
