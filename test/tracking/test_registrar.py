# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A camera carried through a rendered room: every pose is known, and where there is none it must say so."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence

import numpy as np
import pytest
from scipy import stats

from vigg_ros.bench.worlds import HandheldLoop, hall_of_columns, room
from vigg_ros.bench.worlds.poses import Pose, look_at
from vigg_ros.registration import Camera, Config, Frame, Reason, Registration, Rejection
from vigg_ros.registration.features import Features, extract
from vigg_ros.tracking import FrameResult, Registrar, State
from vigg_ros_testing.registration_samples import Studio, errors, looking

CONFIG = Config()
PERIOD_NS = 100_000_000
START_NS = 1_772_013_245_123_456_789


@pytest.fixture(scope="module")
def studio() -> Studio:
    return Studio(room(seed=11))


def poses(first: int, last: int) -> list[Pose]:
    """A hand that goes around a loop of 5 s, seen at 10 Hz."""
    path = HandheldLoop()
    return [path.T_world_camera(0.1 * k) for k in range(first, last)]


def frames(studio: Studio, path: Sequence[Pose | None], first: int = 0) -> list[Frame]:
    """What the camera measures along a path; None is a black frame. Noise and stamps go with the number."""
    out = []
    for k, pose in enumerate(path, start=first):
        frame = blank() if pose is None else studio.frame(pose, 100 + k)
        out.append(Frame(frame.image, frame.camera, frame.geometry, START_NS + k * PERIOD_NS))
    return out


def blank() -> Frame:
    camera = Camera(160, 120, 138.5, 138.5, 79.5, 59.5)
    return Frame.from_depth(np.zeros((120, 160, 3), np.uint8), np.zeros((120, 160), np.float32), camera)


def follow(registrar: Registrar, sequence: Iterable[Frame]) -> list[FrameResult]:
    return [registrar.step(frame) for frame in sequence]


def states(results: Iterable[FrameResult]) -> list[str]:
    return [result.state.value for result in results]


def T_of(result: FrameResult) -> Pose:
    assert result.T_odom_frame is not None, result.outcome
    return result.T_odom_frame


def assert_on_the_path(results: Sequence[FrameResult], path: Sequence[Pose], *, origin: Pose) -> None:
    """Each pose within what its covariance says, and the drift of a few keyframes within centimetres."""
    for result, pose in zip(results, path, strict=True):
        T_true = np.linalg.inv(origin) @ pose
        rotation_deg, translation_m = errors(T_of(result), T_true)
        assert rotation_deg < 1.0
        assert translation_m < 0.03
        if result.state is not State.STARTED:
            assert result.covariance is not None
            error = np.concatenate((T_of(result)[:3, 3] - T_true[:3, 3], [0, 0, 0]))
            share = error[:3] @ np.linalg.solve(result.covariance[:3, :3], error[:3])
            # Of 35 frames the worst; chi2(3) leaves 1 of 10,000 beyond.
            assert share < stats.chi2(3).ppf(0.9999)


@pytest.fixture(scope="module")
def walk(studio: Studio) -> tuple[list[Pose], list[Frame], list[FrameResult]]:
    """Most of the loop: 35 frames, in which the view changes completely and comes back."""
    path = poses(0, 35)
    sequence = frames(studio, path)
    return path, sequence, follow(Registrar(CONFIG), sequence)


def test_every_frame_of_a_walk_is_answered(walk: tuple[list[Pose], list[Frame], list[FrameResult]]) -> None:
    path, sequence, results = walk
    assert states(results) == ["STARTED"] + ["TRACKING"] * 34
    assert [result.stamp_ns for result in results] == [frame.stamp_ns for frame in sequence]
    assert_on_the_path(results, path, origin=path[0])
    assert {result.session for result in results} == {0}


def test_the_first_frame_defines_the_odometry_frame(walk: tuple[list[Pose], list[Frame], list[FrameResult]]) -> None:
    first = walk[2][0]
    np.testing.assert_array_equal(T_of(first), np.eye(4))
    assert first.covariance is not None
    assert not first.covariance.any()
    assert (first.keyframe_id, first.new_keyframe, first.outcome) == (0, True, None)


def test_poses_chain_through_keyframes_without_a_jump(walk: tuple[list[Pose], list[Frame], list[FrameResult]]) -> None:
    """Between two frames the pose moves as the camera did, whether or not the reference changed in between."""
    path, _, results = walk
    references = [result.keyframe_id for result in results]
    assert len(set(references)) >= 3, "the walk is long enough to need keyframes"
    for k in range(1, len(path)):
        moved = np.linalg.inv(T_of(results[k - 1])) @ T_of(results[k])
        rotation_deg, translation_m = errors(moved, np.linalg.inv(path[k - 1]) @ path[k])
        # Two registrations, each off by some millimetres and a tenth of a degree.
        assert rotation_deg < 0.7
        assert translation_m < 0.02
    # And the pose is exactly keyframe times registration.
    taken = {0: T_of(results[0])}
    for result in results[1:]:
        assert isinstance(result.outcome, Registration)
        assert result.keyframe_id is not None
        expected = taken[result.keyframe_id] @ result.outcome.T_target_source
        np.testing.assert_allclose(T_of(result), expected, atol=1e-9)
        if result.new_keyframe:
            taken[max(taken) + 1] = T_of(result)


def test_uncertainty_grows_with_each_keyframe(walk: tuple[list[Pose], list[Frame], list[FrameResult]]) -> None:
    results = walk[2]
    at_keyframes = [np.trace(e.covariance[:3, :3]) for e in results if e.new_keyframe and e.covariance is not None]
    assert len(at_keyframes) >= 3
    assert at_keyframes == sorted(at_keyframes)
    assert at_keyframes[0] == 0 < at_keyframes[1]


def test_a_keyframe_is_taken_when_the_view_has_changed(walk: tuple[list[Pose], list[Frame], list[FrameResult]]) -> None:
    """Not for every frame, and not only when it is too late."""
    results = walk[2]
    taken = sum(result.new_keyframe for result in results)
    assert 3 <= taken <= 12
    followed = [e.outcome for e in results[1:] if isinstance(e.outcome, Registration)]
    assert min(outcome.evidence.overlap for outcome in followed) > 0.3


def as_bytes(results: Iterable[FrameResult]) -> list[bytes]:
    out = []
    for result in results:
        pose, covariance = result.T_odom_frame, result.covariance
        assert pose is not None
        assert covariance is not None
        out.append(pose.tobytes() + covariance.tobytes() + repr((result.state, result.keyframe_id)).encode())
    return out


def test_the_same_frames_give_the_same_bytes(walk: tuple[list[Pose], list[Frame], list[FrameResult]]) -> None:
    _, sequence, results = walk
    assert as_bytes(follow(Registrar(CONFIG), sequence[:12])) == as_bytes(results[:12])


def test_every_step_is_timed(walk: tuple[list[Pose], list[Frame], list[FrameResult]]) -> None:
    for result in walk[2][1:]:
        assert {"keypoints", "surface", "cliques", "refinement"} <= set(result.timings_ms)
        assert min(result.timings_ms.values()) >= 0


def test_blank_frames_are_lost_and_the_next_good_one_is_not(studio: Studio) -> None:
    path = poses(0, 12)
    shown: list[Pose | None] = [None if k in (5, 6, 7) else pose for k, pose in enumerate(path)]
    registrar = Registrar(CONFIG)
    results = follow(registrar, frames(studio, shown))
    assert states(results[5:8]) == ["LOST"] * 3
    for lost in results[5:8]:
        assert lost.T_odom_frame is None
        assert lost.covariance is None
        assert isinstance(lost.outcome, Rejection)
        assert lost.outcome.reason is Reason.NO_TEXTURE
        assert not lost.new_keyframe
    good = [k for k in range(12) if k not in (5, 6, 7)]
    assert "LOST" not in states(results[k] for k in good)
    assert_on_the_path([results[k] for k in good], [path[k] for k in good], origin=path[0])


def pan(first: int, last: int) -> list[Pose]:
    """A camera that turns where it stands, by 7 deg a frame; a view is 60 deg wide."""
    angles = np.deg2rad(7.0 * np.arange(first, last) - 20)
    return [look_at((-0.6, 0, 1.4), (-0.6 + np.cos(a), np.sin(a), 1.15)) for a in angles.tolist()]


def back_at_the_start(studio: Studio, path: Sequence[Pose]) -> tuple[list[FrameResult], list[FrameResult]]:
    """Walked along a path, then carried in the dark to its second pose, where the camera stays for 6 frames."""
    registrar = Registrar(CONFIG)
    walked = follow(registrar, frames(studio, path))
    assert "LOST" not in states(walked)
    back = follow(registrar, frames(studio, [None, *[path[1]] * 6], first=len(path)))
    assert states(back[:1]) == ["LOST"]
    return walked, back


def test_a_place_seen_before_is_found_again(studio: Studio) -> None:
    """Turned by 85 deg, where nothing of the first view is left."""
    path = pan(0, 13)
    walked, back = back_at_the_start(studio, path)
    found = [result for result in back if result.state is not State.LOST]
    assert found, "six frames are more than it takes to try all keyframes, three at a time"
    assert found[0].state is State.RELOCALISED
    assert found[0].keyframe_id is not None
    assert walked[-1].keyframe_id is not None
    assert found[0].keyframe_id < walked[-1].keyframe_id
    assert states(found[1:]) == ["TRACKING"] * (len(found) - 1), "from then on it is followed there"
    assert_on_the_path(found, [path[1]] * len(found), origin=path[0])


def test_each_lost_frame_tries_other_keyframes(studio: Studio) -> None:
    """One retry a frame: not the first keyframe again and again."""
    config = CONFIG.replace({"keyframes.retries": 1, "keyframes.max_rotation_deg": 12.0})
    path = pan(0, 13)
    registrar = Registrar(config)
    walked = follow(registrar, frames(studio, path))
    keyframes = sum(result.new_keyframe for result in walked)
    assert keyframes > 4
    tried = []
    for frame in frames(studio, [None] * keyframes, first=13):
        others = registrar._keyframes.others(np.zeros(3), 1, registrar._frames_lost)
        tried += [keyframe.id for keyframe in others]
        assert registrar.step(frame).state is State.LOST
    assert set(tried) == set(range(keyframes - 1))


@pytest.mark.parametrize("turned", [15, 18])
def test_a_place_seen_before_is_not_taken_for_another_corner(turned: int, studio: Studio) -> None:
    """A corner fits onto another one by its walls and floor, turned by 90 or 180 deg; what is seen there does not."""
    path = pan(0, turned)
    _, back = back_at_the_start(studio, path)
    for result in back:
        if result.T_odom_frame is not None:
            assert errors(result.T_odom_frame, np.linalg.inv(path[0]) @ path[1])[1] < 0.05, result.outcome


def test_a_place_never_seen_is_lost(studio: Studio) -> None:
    registrar = Registrar(CONFIG)
    path = pan(0, 3)
    follow(registrar, frames(studio, path))
    results = follow(registrar, frames(studio, [*pan(19, 21), path[2]], first=3))
    assert states(results) == ["LOST", "LOST", "TRACKING"]
    assert all(result.T_odom_frame is None for result in results[:2])
    assert_on_the_path(results[2:], path[2:], origin=path[0])


def test_another_world_is_never_answered(studio: Studio) -> None:
    """The camera is carried out of the room; what it sees there has no place in the old frame."""
    registrar = Registrar(CONFIG)
    follow(registrar, frames(studio, poses(0, 3)))
    hall = Studio(hall_of_columns(seed=2))
    view = [look_at((0.1 * k, 0.3, 1.4), (0.1 * k + 2, 0.1, 1.2)) for k in range(3)]
    results = follow(registrar, frames(hall, view, first=3))
    assert states(results) == ["LOST"] * 3
    assert all(result.T_odom_frame is None for result in results)


def test_reset_starts_another_session(studio: Studio) -> None:
    sequence = frames(studio, poses(0, 4))
    registrar = Registrar(CONFIG)
    before = follow(registrar, sequence[:2])
    registrar.reset()
    assert registrar.reference is None
    after = follow(registrar, sequence[2:])
    assert states(before + after) == ["STARTED", "TRACKING", "STARTED", "TRACKING"]
    np.testing.assert_array_equal(T_of(after[0]), np.eye(4))
    assert before[0].session != after[0].session == after[1].session


def test_a_new_session_of_the_input_resets(studio: Studio) -> None:
    sequence = frames(studio, poses(0, 4))
    registrar = Registrar(CONFIG)
    results = [registrar.step(frame, session=number) for frame, number in zip(sequence, (0, 0, 3, 3), strict=True)]
    assert states(results) == ["STARTED", "TRACKING", "STARTED", "TRACKING"]
    assert [result.session for result in results] == [0, 0, 3, 3]
    np.testing.assert_array_equal(T_of(results[2]), np.eye(4))


def test_an_unusable_first_frame_starts_nothing(studio: Studio) -> None:
    """The identity is where a usable frame was, never an answer to a frame that showed nothing."""
    path = poses(0, 2)
    registrar = Registrar(CONFIG)
    results = follow(registrar, frames(studio, [None, None, *path]))
    assert states(results) == ["LOST", "LOST", "STARTED", "TRACKING"]
    for lost in results[:2]:
        assert lost.T_odom_frame is None
        assert lost.keyframe_id is None
        assert isinstance(lost.outcome, Rejection)
    assert_on_the_path(results[2:], path, origin=path[0])


def test_an_answer_is_never_the_identity_unless_the_camera_stood_still(studio: Studio) -> None:
    """Each frame is 2 m and a turn from the last: no pose at all, or the right one."""
    back, aside = look_at((1.2, -0.9, 1.5), (-2, 1.2, 0.6)), look_at((0, 0.8, 1.2), (0, -2, 1))
    jumps = [looking(), back, looking((0.1, 0, 0)), aside]
    for result, pose in zip(follow(Registrar(CONFIG), frames(studio, jumps))[1:], jumps[1:], strict=True):
        if result.T_odom_frame is None:
            assert result.state is State.LOST
        else:
            assert errors(result.T_odom_frame, np.linalg.inv(jumps[0]) @ pose)[1] < 0.05


def test_the_buffer_stays_bounded(studio: Studio) -> None:
    """A keyframe for every frame, and room for three."""
    config = CONFIG.replace({"keyframes.buffer_size": 3, "keyframes.min_overlap": 1.0})
    registrar = Registrar(config)
    path = poses(0, 8)
    results = follow(registrar, frames(studio, path))
    assert all(result.new_keyframe for result in results)
    assert [result.keyframe_id for result in results] == [0, 0, 1, 2, 3, 4, 5, 6]
    assert len(registrar._keyframes) == 3
    assert_on_the_path(results, path, origin=path[0])


@pytest.mark.parametrize("dark", [None, 1], ids=["always seen", "lost before"])
def test_a_reference_out_of_sight_is_replaced_by_the_last_frame(dark: int | None, studio: Studio) -> None:
    """Keyframes are taken so late that the reference no longer suffices; the last frame does, and becomes one."""
    config = CONFIG.replace(
        {
            "keyframes.min_overlap": 0.05,
            "keyframes.min_inliers": 3,
            "keyframes.max_translation_m": 100.0,
            "keyframes.max_rotation_deg": 180.0,
            "keyframes.retries": 0,
            "acceptance.min_overlap": 0.5,
        }
    )
    path = [looking((0, 0.1 * k, 0), (0, 0.25 * k, 0)) for k in range(7)]
    shown = [None if k == dark else pose for k, pose in enumerate(path)]
    results = follow(Registrar(config), frames(studio, shown))
    seen = [k for k in range(7) if k != dark]
    assert states(results[k] for k in seen) == ["STARTED"] + ["TRACKING"] * (len(seen) - 1)
    assert not any(result.new_keyframe for result in results[1:])
    assert len({results[k].keyframe_id for k in seen}) > 1
    assert_on_the_path([results[k] for k in seen], [path[k] for k in seen], origin=path[0])


def test_a_result_shows_what_was_compared(studio: Studio) -> None:
    first, second, third = follow(Registrar(CONFIG), frames(studio, [*poses(0, 2), None]))
    assert first.compared is not None
    assert first.compared.keyframe is None
    assert second.compared is not None
    assert second.compared.keyframe is not None
    assert second.compared.keyframe.id == second.keyframe_id
    assert isinstance(second.outcome, Registration)
    compared = second.compared.keyframe.features.keypoints, second.compared.features.keypoints
    for keypoints, pixels in zip(compared, np.hsplit(second.outcome.visual_inliers_px, 2), strict=True):
        assert set(map(tuple, pixels.tolist())) <= set(map(tuple, keypoints.pixels.tolist()))
    assert third.compared is not None
    assert len(third.compared.features.keypoints) == 0
    kept = second.kept()
    assert (kept.compared, kept.outcome.visual_inliers_px.shape) == (None, (0, 4))
    assert (kept.T_odom_frame is second.T_odom_frame, kept.evidence) == (True, second.evidence)


def test_a_frame_whose_time_is_up_is_lost_and_the_next_one_is_not(studio: Studio) -> None:
    """The budget holds for extraction too, and for the first frame."""
    path = poses(0, 4)
    sequence = frames(studio, path)
    registrar = Registrar(CONFIG.replace({"time_budget_s": 1e-9}))
    first = registrar.step(sequence[0])
    assert (first.state, first.reason, first.keyframe_id, first.compared) == (State.LOST, "TIMEOUT", None, None)
    registrar.configure(CONFIG)
    assert registrar.step(sequence[1]).state is State.STARTED
    registrar.configure(CONFIG.replace({"time_budget_s": 1e-9}))
    late = registrar.step(sequence[2])
    assert late.state is State.LOST
    assert late.T_odom_frame is None
    assert isinstance(late.outcome, Rejection)
    assert late.outcome.reason is Reason.TIMEOUT
    registrar.configure(CONFIG.replace({"time_budget_s": 60.0}))
    assert registrar.step(sequence[3]).state is State.TRACKING


def test_time_may_be_up_while_the_first_frame_is_searched_in_full(monkeypatch: pytest.MonkeyPatch) -> None:
    """An image without texture is searched once more, in full size, after its features were extracted."""
    camera = Camera(640, 480, 500.0, 500.0, 319.5, 239.5)
    grey = Frame.from_depth(np.full((480, 640, 3), 90, np.uint8), np.full((480, 640), 2, np.float32), camera)
    features = extract(grey, CONFIG)

    def late(frame: Frame, config: Config) -> Features:
        time.sleep(0.01)
        return features

    monkeypatch.setattr("vigg_ros.tracking.registrar.extract", late)
    result = Registrar(CONFIG.replace({"time_budget_s": 0.005})).step(grey)
    assert (result.state, result.reason) == (State.LOST, "TIMEOUT")
