# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is kept with a frame: at once, or when doubt asks for it."""


import numpy as np

from vigg_ros.bench.worlds.poses import Pose, look_at
from vigg_ros.registration import Config, Features, Reason, Registration, Rejection, extract, register
from vigg_ros.registration.stages import record_stages
from vigg_ros_testing.registration_samples import CAMERA, Studio, answer, errors, looking, truth

REDUCED = Config().replace({"visual.max_pixels": 10_000})
"""The studio's images have 19,200 pixels."""


def test_an_image_that_is_small_enough_is_searched_once(studio: Studio) -> None:
    features = extract(studio.frame(looking(), 1), Config())
    assert features.fine_keypoints is features.keypoints


def test_a_reduced_image_has_fewer_keypoints_at_the_pixels_of_the_full_one(studio: Studio) -> None:
    whole = studio.features(looking(), 1)
    assert whole.fine_keypoints is whole.keypoints, "an image that is small enough is searched once"
    features = extract(studio.frame(looking(), 1), REDUCED)
    few, many = features.keypoints, features.fine_keypoints
    assert 20 < len(few) < len(many)
    for keypoints in (few, many):
        inside = (keypoints.pixels >= 0) & (keypoints.pixels <= (CAMERA.width_px - 1, CAMERA.height_px - 1))
        assert inside.all()
        np.testing.assert_allclose(CAMERA.project(keypoints.points), keypoints.pixels, atol=1e-3)
    # Most strong corners are found in both, within a pixel of the reduced image.
    nearest = np.linalg.norm(few.pixels[:, None] - many.pixels[None], axis=2).min(axis=1)
    assert np.mean(nearest < 1.4) > 0.6


def reduced(studio: Studio, *poses: Pose) -> list[Features]:
    return [extract(studio.frame(pose, seed), REDUCED) for seed, pose in enumerate(poses)]


def test_clear_pairs_need_neither_landmarks_nor_the_full_image(studio: Studio) -> None:
    poses = looking(), looking((0.05, 0.05, 0))
    target, source = reduced(studio, *poses)
    with record_stages() as timings_ms:
        found = answer(register(target, source, REDUCED))
    assert not {"features", "global matches", "local matches", "keypoints"} & set(timings_ms)
    assert np.isnan(found.evidence.photometric_correlation)
    assert errors(found.T_target_source, truth(*poses))[1] < 0.02


def test_doubt_calls_for_everything_and_it_is_kept(studio: Studio) -> None:
    # Turned by 42 deg of 60: a dozen keypoints in common.
    poses = (look_at((-0.6, 0, 1.4), (-0.6 + np.cos(a), np.sin(a), 1.15)) for a in np.deg2rad((106, 148)))
    with record_stages() as timings_ms:
        target, source = reduced(studio, *poses)
        register(target, source, REDUCED)
    stages = {"features", "global matches", "local matches", "keypoints"}  # and those of every pair:
    assert stages | {"surface", "visual matches", "cliques", "refinement", "verification"} <= set(timings_ms)
    with record_stages() as timings_ms:
        again = register(target, source, REDUCED)
    assert not {"features", "keypoints"} & set(timings_ms), "made anew"
    if isinstance(again, Registration):
        assert again.evidence.visual_inliers == len(again.visual_inliers_px)


def test_a_time_budget_that_is_used_up_is_a_rejection(studio: Studio) -> None:
    pair = studio.pair((looking(), looking((0.05, 0, 0))))
    found = register(*pair, Config().replace({"time_budget_s": 1e-9}))
    assert isinstance(found, Rejection)
    assert found.reason is Reason.TIMEOUT
    assert "time budget of 1e-09 s" in found.message
    answer(register(*pair, Config().replace({"time_budget_s": 60})))
