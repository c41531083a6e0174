# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Two looks at a rendered room: the motion between them is known, and so is the noise."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy import stats

from vigg_ros.bench.worlds import Light, Scene, render_rgbd
from vigg_ros.bench.worlds.poses import Pose, look_at
from vigg_ros.bench.worlds.surfaces import Sphere
from vigg_ros.registration import Config, Frame, Outcome, Registration, extract, register
from vigg_ros_testing.registration_samples import (
    CAMERA,
    Studio,
    answer,
    apply,
    assert_near,
    error_vector,
    looking,
    motion,
    noisy,
    normalised_error,
    truth,
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


def assert_within_noise(outcome: object, T_true: Pose) -> Registration:
    """Right, to a degree that does not depend on the method, and as exact as the answer itself claims."""
    found = answer(outcome)
    # A pixel is 0.4 deg wide and depth is off by 13 mm at 3 m. Some hundred independent patches leave a
    # tenth of that; what they see of the room is 3 m away, which turns 0.1 deg into 5 mm.
    assert_near(found.T_target_source, T_true, rotation_deg=0.5, translation_m=0.015)
    assert normalised_error(found, T_true) < stats.chi2(6).ppf(REFUSED / 100)
    return found


def register_frames(target: Frame, source: Frame, config: Config = CONFIG) -> Outcome:
    return register(extract(target, config), extract(source, config), config)


@pytest.mark.parametrize("pair", PAIRS.values(), ids=PAIRS)
def test_the_motion_is_found_within_what_the_noise_explains(pair: tuple[Pose, Pose], studio: Studio) -> None:
    found = assert_within_noise(register(*studio.pair(pair), CONFIG), truth(*pair))
    np.testing.assert_allclose(found.covariance, found.covariance.T)
    assert np.linalg.eigvalsh(found.covariance).min() > 0
    np.testing.assert_allclose(found.T_target_source[:3, :3] @ found.T_target_source[:3, :3].T, np.eye(3), atol=1e-9)


def test_without_noise_the_motion_is_found_to_a_fraction_of_a_millimetre(studio: Studio) -> None:
    """What is left is the voxel grid, which cuts the same surfaces elsewhere in the two frames."""
    pair = PAIRS["all at once"]
    found = answer(register(*studio.pair(pair, (None, None)), CONFIG))
    assert_near(found.T_target_source, truth(*pair), rotation_deg=0.02, translation_m=0.001)


@pytest.mark.parametrize("name", ["a step", "a look aside", "all at once"])
def test_swapping_source_and_target_inverts_the_answer(name: str, studio: Studio) -> None:
    """Not to the digit: each direction samples its own source, and pairs it with the other's surface."""
    target, source = studio.pair(PAIRS[name])
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
    found = []
    for scene, T in ((old, np.eye(4)), (new, T_new_old)):
        frames = (noisy(*render_rgbd(scene, CAMERA, T @ pose), seed=i) for i, pose in enumerate(PAIRS["a step"]))
        found.append(answer(register_frames(*frames)).T_target_source)
    # Rays differ by 1e-15, which may round a grey level or two to the other side, and move a keypoint.
    assert_near(found[1], found[0], rotation_deg=0.01, translation_m=0.0005)


def as_bytes(outcome: object) -> tuple[bytes, ...]:
    found = answer(outcome)
    return (
        found.T_target_source.tobytes(),
        found.covariance.tobytes(),
        found.visual_inliers_px.tobytes(),
        repr(found.evidence).encode(),
    )


def test_the_same_frames_give_the_same_bytes(studio: Studio) -> None:
    """Also with other threads, as OpenCV finds keypoints in parallel, and with features that have served before."""
    frames = [studio.frame(pose, seed) for seed, pose in enumerate(PAIRS["all at once"])]
    threads = cv2.getNumThreads()
    outcomes = []
    try:
        for count in (1, 1, 4):
            cv2.setNumThreads(count)
            target, source = (extract(frame, CONFIG) for frame in frames)
            outcomes.append(as_bytes(register(target, source, CONFIG)))
        register(source, target, CONFIG)
        outcomes.append(as_bytes(register(target, source, CONFIG)))
    finally:
        cv2.setNumThreads(threads)
    assert len(set(outcomes)) == 1


def test_another_seed_samples_other_points_and_finds_the_same_motion(studio: Studio) -> None:
    """Of two depth images the points of global and local matches only: all of their planes are aligned."""
    pair = PAIRS["all at once"]
    sampled = CONFIG.replace({"geometric.sample_k": 2000, "geometric.always": True})
    configs = (sampled.replace({"seed": seed}) for seed in (0, 1))
    one, other = (register(*studio.pair(pair), config) for config in configs)
    assert as_bytes(one) != as_bytes(other)
    assert_within_noise(other, truth(*pair))


def test_the_evidence_counts_what_the_answer_shows(studio: Studio) -> None:
    target, source = studio.pair(PAIRS["all at once"])
    found = answer(register(target, source, CONFIG))
    evidence = found.evidence
    assert evidence.keypoints == len(source.keypoints)
    assert evidence.visual_inliers == len(found.visual_inliers_px)
    rows_target, rows_source = (
        [seen.keypoints.pixels.tolist().index(pixel) for pixel in pixels.tolist()]
        for seen, pixels in ((target, found.visual_inliers_px[:, :2]), (source, found.visual_inliers_px[:, 2:]))
    )
    moved = apply(found.T_target_source, source.keypoints.points[rows_source])
    off_m = np.linalg.norm(moved - target.keypoints.points[rows_target], axis=1)
    assert off_m.max() < CONFIG.cliques.inlier_threshold_m
    assert evidence.visual_inliers <= evidence.visual_matches <= CONFIG.visual.top_k
    assert 0 < evidence.overlap < evidence.consistency <= 1
    assert evidence.hypotheses >= evidence.candidates >= 1
    # Surfaces of Kinect noise at 2 to 3 m, both together: about 1 cm.
    assert 0.002 < evidence.rmse_m < 0.03


@pytest.mark.parametrize(
    ("config", "rotation_deg", "translation_m"),
    [
        # The paper's method stops at correspondences of a voxel grid: 2.5 cm, less the mean over thousands.
        (Config.preset("rgbd_paper"), 2.0, 0.05),
        (CONFIG.replace({"visual.detector": "orb"}), 0.5, 0.015),
    ],
    ids=["the paper's method", "ORB"],
)
def test_other_methods_find_the_motion(config, rotation_deg, translation_m, studio) -> None:
    pair = PAIRS["a step"]
    found = answer(register_frames(*(studio.frame(pose, seed) for seed, pose in enumerate(pair)), config))
    assert_near(found.T_target_source, truth(*pair), rotation_deg=rotation_deg, translation_m=translation_m)
    assert found.evidence.visual_inliers >= 8


def test_shapes_answer_where_the_images_hardly_share_a_view(studio: Studio) -> None:
    """Turned by 42 deg of 60: a dozen keypoints are left, and a third of the surface."""
    pair = tuple(
        look_at((-0.6, 0, 1.4), (-0.6 + np.cos(angle), np.sin(angle), 1.15)) for angle in np.deg2rad((106, 148))
    )
    config = CONFIG.replace({"geometric.always": True})  # a dozen of 38 are beyond chance on their own
    found = answer(register(*studio.pair(pair, (118, 124)), config))
    assert found.evidence.visual_inliers < 20 < found.evidence.geometric_inliers
    # Less surface to average over, and all of it at one side of the view.
    assert_near(found.T_target_source, truth(*pair), rotation_deg=1.0, translation_m=0.03)


@pytest.mark.hostile("Scene: pure rotation A")
@pytest.mark.parametrize("roll_deg", [0, 5, 60])
def test_a_pure_rotation_is_accepted(roll_deg: float, studio: Studio) -> None:
    pair = looking(), looking((0, 0, 0), (0, 0.4, -0.1), roll_deg)
    assert_within_noise(register(*studio.pair(pair), CONFIG), truth(*pair))


@pytest.mark.hostile("Scene: no motion A, covariance not 0")
def test_no_motion_is_accepted(studio: Studio) -> None:
    found = assert_within_noise(register(*studio.pair((looking(), looking())), CONFIG), np.eye(4))
    assert found.evidence.overlap > 0.9
    # A frozen camera, or a simulated one at rest, sends equal frames; a covariance of 0 breaks any filter.
    for seed in (None, 1):
        features = studio.features(looking(), seed)
        found = answer(register(features, features, CONFIG))
        np.testing.assert_allclose(found.T_target_source, np.eye(4), atol=1e-6)
        deviation = np.sqrt(np.linalg.eigvalsh(found.covariance))
        # A grid of 2.5 cm does not tell a place to a micrometre, and does to some millimetres.
        assert 1e-6 < deviation.min() < deviation.max() < 5e-3


@pytest.mark.hostile("Scene: exposure jump, blur")
@pytest.mark.parametrize(("gain", "blur_px"), [(0.4, 1), (0.7, 1), (1.5, 1), (2.2, 1), (1.0, 3), (1.0, 5), (1.0, 9)])
def test_exposure_and_blur_are_no_motion(gain: float, blur_px: int, studio: Studio) -> None:
    """Blurred along x, as a pan of the camera does it; nine pixels of 160 are 3 deg in one exposure."""
    target, source = PAIRS["a step"]
    image, depth_m = studio.view(source)
    frame = noisy(cv2.blur(image, (blur_px, 1)), depth_m, seed=2, gain=gain)
    assert_within_noise(register(studio.features(target, 1), extract(frame, CONFIG), CONFIG), truth(target, source))


def test_a_single_textured_wall_is_determined_by_its_visual_matches(wall: Studio) -> None:
    pair = looking((0.8, 0, 0)), looking((0.9, -0.1, 0))
    assert_within_noise(register(*wall.pair(pair), CONFIG), truth(*pair))


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_holes_in_the_depth_leave_the_rest(share: float, studio: Studio) -> None:
    """Blocks of 10 pixels without depth, others in each frame, as on glass and black things."""
    rng = np.random.default_rng(0)
    pair = PAIRS["a step"]

    def holed(pose: Pose, seed: int) -> Frame:
        image, depth_m = studio.view(pose)
        lost = np.kron(rng.random((12, 16)) < share, np.ones((10, 10), bool))
        return noisy(image, np.where(lost, 0, depth_m), seed=seed)

    found = answer(register_frames(holed(pair[0], 1), holed(pair[1], 2)))
    # As within noise, with as much less of the room to average over as both frames leave.
    left = 1 - share
    assert_near(found.T_target_source, truth(*pair), rotation_deg=0.5 / left, translation_m=0.015 / left)
