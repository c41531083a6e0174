# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A camera carried through a rendered room: every pose is known, and where there is none it must say so."""

import time
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from vigg_ros.bags.decoding import message_types
from vigg_ros.bench.worlds import HandheldLoop
from vigg_ros.bench.worlds.poses import look_at
from vigg_ros.messages.fields import ROSBAGS, build
from vigg_ros.messages.sensor_messages import encode_camera_info, encode_image
from vigg_ros.pipeline import Pipeline
from vigg_ros.registration import Camera, Config, Frame, Reason, Registration, Rejection
from vigg_ros.registration.features import Features, extract
from vigg_ros.registration.stages import OutOfTime
from vigg_ros.sensors.header import NS_PER_S
from vigg_ros.tracking import Registrar, State
from vigg_ros.tracking.keyframes import KeyframeBuffer
from vigg_ros_testing.registration_samples import CAMERA, errors, looking, measured

CONFIG = Config()
PERIOD_NS = 100_000_000
START_NS = 1_772_013_245_123_456_789


def poses(first, last):
    """A hand that goes around a loop of 5 s, seen at 10 Hz."""
    path = HandheldLoop()
    return [path.T_world_camera(0.1 * k) for k in range(first, last)]


def frames(studio, path, first=0):
    """What the camera measures along a path; None is a black frame. Noise and stamps go with the number."""
    out = []
    for k, pose in enumerate(path, start=first):
        frame = blank() if pose is None else studio.frame(pose, 100 + k)
        out.append(Frame(frame.image, frame.camera, frame.geometry, START_NS + k * PERIOD_NS))
    return out


def blank():
    camera = Camera(160, 120, 138.5, 138.5, 79.5, 59.5)
    return Frame.from_depth(np.zeros((120, 160, 3), np.uint8), np.zeros((120, 160), np.float32), camera)


def follow(registrar, sequence):
    return [registrar.step(frame) for frame in sequence]


def states(results):
    return [result.state.value for result in results]


def assert_on_the_path(results, path, *, origin):
    """Each pose within what its covariance says, and the drift of a few keyframes within centimetres."""
    for result, pose in zip(results, path, strict=True):
        T_true = np.linalg.inv(origin) @ pose
        rotation_deg, translation_m = errors(result.T_odom_frame, T_true)
        assert rotation_deg < 1.0
        assert translation_m < 0.03
        if result.state is not State.STARTED:
            error = np.concatenate((result.T_odom_frame[:3, 3] - T_true[:3, 3], [0, 0, 0]))
            share = error[:3] @ np.linalg.solve(result.covariance[:3, :3], error[:3])
            # Of 18 frames the worst; chi2(3) leaves 1 of 10,000 beyond.
            assert share < stats.chi2(3).ppf(0.9999)


@pytest.fixture(scope="module")
def walk(studio):
    """Most of the loop at 5 Hz: 18 frames, in which the view changes completely and comes back."""
    path = poses(0, 35)[::2]
    sequence = frames(studio, path)
    return path, sequence, follow(Registrar(CONFIG), sequence)


def test_every_frame_of_a_walk_is_answered(walk):
    path, sequence, results = walk
    assert states(results) == ["STARTED"] + ["TRACKING"] * 17
    assert [result.stamp_ns for result in results] == [frame.stamp_ns for frame in sequence]
    assert_on_the_path(results, path, origin=path[0])
    assert {result.session for result in results} == {0}
    for result in results[1:]:
        assert {"keypoints", "surface", "cliques", "refinement"} <= set(result.timings_ms)
        assert min(result.timings_ms.values()) >= 0


def test_the_first_frame_defines_the_odometry_frame(walk):
    first = walk[2][0]
    np.testing.assert_array_equal(first.T_odom_frame, np.eye(4))
    assert not first.covariance.any()
    assert (first.keyframe_id, first.new_keyframe, first.outcome) == (0, True, None)


def test_poses_chain_through_keyframes_without_a_jump(walk):
    """Between two frames the pose moves as the camera did, whether or not the reference changed in between."""
    path, _, results = walk
    assert len({result.keyframe_id for result in results}) >= 3, "the walk is long enough to need keyframes"
    for k in range(1, len(path)):
        moved = np.linalg.inv(results[k - 1].T_odom_frame) @ results[k].T_odom_frame
        rotation_deg, translation_m = errors(moved, np.linalg.inv(path[k - 1]) @ path[k])
        # Two registrations, each off by some millimetres and a tenth of a degree.
        assert rotation_deg < 0.7
        assert translation_m < 0.02
    # And the pose is exactly keyframe times registration.
    taken = {0: results[0].T_odom_frame}
    for result in results[1:]:
        expected = taken[result.keyframe_id] @ result.outcome.T_target_source
        np.testing.assert_allclose(result.T_odom_frame, expected, atol=1e-9)
        if result.new_keyframe:
            taken[max(taken) + 1] = result.T_odom_frame


def test_keyframes_are_taken_when_the_view_has_changed_and_each_adds_to_the_uncertainty(walk):
    """Not for every frame, and not only when it is too late."""
    results = walk[2]
    at_keyframes = [np.trace(result.covariance[:3, :3]) for result in results if result.new_keyframe]
    assert 3 <= len(at_keyframes) <= 12
    assert at_keyframes == sorted(at_keyframes)
    assert at_keyframes[0] == 0 < at_keyframes[1]
    assert min(result.evidence.overlap for result in results[1:]) > 0.3


def test_the_same_frames_give_the_same_bytes(walk):
    _, sequence, results = walk
    for first, again in zip(results[:8], follow(Registrar(CONFIG), sequence[:8]), strict=True):
        assert (first.state, first.keyframe_id) == (again.state, again.keyframe_id)
        np.testing.assert_array_equal(first.T_odom_frame, again.T_odom_frame)
        np.testing.assert_array_equal(first.covariance, again.covariance)


def test_blank_frames_are_lost_and_the_next_good_one_is_not(studio):
    path = poses(0, 12)
    shown = [None if k in (5, 6, 7) else pose for k, pose in enumerate(path)]
    registrar = Registrar(CONFIG)
    results = follow(registrar, frames(studio, shown))
    assert states(results[5:8]) == ["LOST"] * 3
    for lost in results[5:8]:
        assert lost.T_odom_frame is None
        assert lost.covariance is None
        assert lost.outcome.reason is Reason.NO_TEXTURE
        assert not lost.new_keyframe
    good = [k for k in range(12) if k not in (5, 6, 7)]
    assert "LOST" not in states(results[k] for k in good)
    assert_on_the_path([results[k] for k in good], [path[k] for k in good], origin=path[0])


def pan(first, last):
    """A camera that turns where it stands, by 7 deg a frame; a view is 60 deg wide."""
    angles = np.deg2rad(7.0 * np.arange(first, last) - 20)
    return [look_at((-0.6, 0, 1.4), (-0.6 + np.cos(a), np.sin(a), 1.15)) for a in angles.tolist()]


def back_at_the_start(studio, path):
    """Walked along a path, then carried in the dark to its second pose, where the camera stays for 6 frames."""
    registrar = Registrar(CONFIG)
    walked = follow(registrar, frames(studio, path))
    assert "LOST" not in states(walked)
    back = follow(registrar, frames(studio, [None, *[path[1]] * 6], first=len(path)))
    assert states(back[:1]) == ["LOST"]
    return walked, back


def test_a_place_seen_before_is_found_again(studio):
    """Turned by 85 deg, where nothing of the first view is left."""
    path = pan(0, 13)
    walked, back = back_at_the_start(studio, path)
    found = [result for result in back if result.state is not State.LOST]
    assert found, "six frames are more than it takes to try all keyframes, three at a time"
    assert found[0].state is State.RELOCALISED
    assert found[0].keyframe_id < walked[-1].keyframe_id
    assert states(found[1:]) == ["TRACKING"] * (len(found) - 1), "from then on it is followed there"
    assert_on_the_path(found, [path[1]] * len(found), origin=path[0])


def test_each_lost_frame_tries_other_keyframes(studio, hall, monkeypatch):
    """One retry a frame: not the first keyframe again and again."""
    tried, others = [], KeyframeBuffer.others

    def watched(*arguments):
        found = others(*arguments)
        tried.extend(keyframe.id for keyframe in found)
        return found

    registrar = Registrar(CONFIG.replace({"keyframes.retries": 1, "keyframes.max_rotation_deg": 5.0}))
    keyframes = sum(result.new_keyframe for result in follow(registrar, frames(studio, pan(0, 5))))
    assert keyframes > 3
    monkeypatch.setattr(KeyframeBuffer, "others", watched)
    elsewhere = [look_at((0, 0.3, 1.4), (2, 0.1, 1.2))] * keyframes
    assert states(follow(registrar, frames(hall, elsewhere, first=5))) == ["LOST"] * keyframes
    assert set(tried) == set(range(keyframes - 1))


@pytest.mark.parametrize("turned", [15, pytest.param(18, marks=pytest.mark.slow)])
def test_a_place_seen_before_is_not_taken_for_another_corner(turned, studio):
    """A corner fits onto another one by its walls and floor, turned by 90 or 180 deg; what is seen there does not."""
    path = pan(0, turned)
    _, back = back_at_the_start(studio, path)
    for result in back:
        if result.T_odom_frame is not None:
            assert errors(result.T_odom_frame, np.linalg.inv(path[0]) @ path[1])[1] < 0.05, result.outcome


def test_a_place_never_seen_is_lost(studio):
    registrar = Registrar(CONFIG)
    path = pan(0, 3)
    follow(registrar, frames(studio, path))
    results = follow(registrar, frames(studio, [*pan(19, 21), path[2]], first=3))
    assert states(results) == ["LOST", "LOST", "TRACKING"]
    assert all(result.T_odom_frame is None for result in results[:2])
    assert_on_the_path(results[2:], path[2:], origin=path[0])


def test_another_world_is_never_answered(studio, hall):
    """The camera is carried out of the room; what it sees there has no place in the old frame."""
    registrar = Registrar(CONFIG)
    follow(registrar, frames(studio, poses(0, 3)))
    view = [look_at((0.1 * k, 0.3, 1.4), (0.1 * k + 2, 0.1, 1.2)) for k in range(3)]
    results = follow(registrar, frames(hall, view, first=3))
    assert states(results) == ["LOST"] * 3
    assert all(result.T_odom_frame is None for result in results)


ELSEWHERE = [look_at((0, 0.3 + 0.02 * k, 1.4), (2, 0.1, 1.2)) for k in range(6)]
"""In another world; at 1 Hz."""


def walked_and_carried_away(studio, hall, config, *, shown=None):
    """Two frames at 10 Hz in the room, then six at 1 Hz in the hall, or where ``shown`` says."""
    registrar = Registrar(config)
    before = follow(registrar, frames(studio, poses(0, 2)))
    carried = frames(hall, ELSEWHERE) if shown is None else shown
    after = [registrar.step(replace(frame, stamp_ns=before[-1].stamp_ns + (k + 1) * NS_PER_S))
             for k, frame in enumerate(carried)]  # fmt: skip
    return registrar, before, after


def test_after_too_long_without_a_pose_a_new_session_begins_by_itself(studio, hall):
    _, before, after = walked_and_carried_away(studio, hall, CONFIG)
    assert states(before + after) == ["STARTED", "TRACKING", "LOST", "LOST", "STARTED", *["TRACKING"] * 3]
    assert [result.session for result in before + after] == [0, 0, 0, 0, 1, 1, 1, 1]
    assert after[2].message == "lost for 3.0 s: a new session starts"
    assert [note.code for result in before + after for note in result.notes] == ["LOST_TIMEOUT"]
    assert (after[2].keyframe_id, after[2].reason, after[2].outcome, after[2].new_keyframe) == (0, "", None, True)
    np.testing.assert_array_equal(after[2].T_odom_frame, np.eye(4))
    for result, pose in zip(after[2:], ELSEWHERE[2:], strict=True):
        rotation_deg, translation_m = errors(result.T_odom_frame, np.linalg.inv(ELSEWHERE[2]) @ pose)
        assert rotation_deg < 1.0
        assert translation_m < 0.02  # of steps of 2 cm


def test_messages_of_a_place_never_seen_begin_a_session_too(studio, hall):
    """Through the pipeline, that of the node and of a replay; an image without depth is of the session of its time."""
    pipeline = Pipeline(CONFIG)
    shown = [(studio, poses(0, 1)[0], 0.0), *((hall, pose, 1.0 + k) for k, pose in enumerate(ELSEWHERE[:4]))]
    results = []
    for number, (world, pose, at_s) in enumerate(shown):
        image, depth_m = measured(*world.view(pose), seed=number)
        at = {"stamp_ns": START_NS + round(at_s * NS_PER_S), "frame_id": "optical"}
        messages = {"camera_info": encode_camera_info(CAMERA, **at), "image": encode_image(image, **at)}
        messages |= {"depth": encode_image(depth_m, **at)} if number != 4 else {}
        for role, message in messages.items():
            results += pipeline.feed(role, build(message, message_types().types.__getitem__, ROSBAGS))
    results += pipeline.flush()
    assert states(results) == ["STARTED", "LOST", "LOST", "STARTED", "REFUSED"]
    assert [result.session for result in results] == [0, 0, 0, 1, 1]
    (note,) = pipeline.notes.values()
    assert str(note).startswith("found no pose for 3.0 s, a new session began")


@pytest.mark.parametrize(("timeout_s", "lost"), [(0.0, 6), (4.5, 4)])
def test_the_time_without_a_pose_is_as_configured_and_0_is_never(timeout_s, lost, studio, hall):
    config = CONFIG.replace({"keyframes.lost_timeout_s": timeout_s})
    _, _, after = walked_and_carried_away(studio, hall, config)
    assert states(after) == ["LOST"] * lost + ["STARTED", "TRACKING"][: 6 - lost]


def test_frames_that_show_nothing_begin_no_session_and_a_place_known_is_still_found_after_them(studio, hall):
    """A lens covered for longer than the timeout: the session goes on where the camera stands still, and elsewhere the
    first frame that shows something begins another one."""
    dark = frames(hall, [None] * 4)
    _, _, same = walked_and_carried_away(studio, hall, CONFIG, shown=[*dark, *frames(studio, poses(2, 3))])
    assert states(same) == ["LOST"] * 4 + ["TRACKING"]
    assert {result.session for result in same} == {0}
    _, _, other = walked_and_carried_away(studio, hall, CONFIG, shown=[*dark, *frames(hall, ELSEWHERE[:2])])
    assert states(other) == ["LOST"] * 4 + ["STARTED", "TRACKING"]


def test_every_keyframe_is_asked_before_a_session_is_given_up(studio):
    """In the dark for longer than the timeout, then where only the first of five keyframes has been, one asked a
    frame."""
    few = {"keyframes.retries": 1, "keyframes.max_rotation_deg": 5.0, "keyframes.lost_timeout_s": 0.5}
    registrar = Registrar(CONFIG.replace(few))
    path = pan(0, 13)
    keyframes = sum(result.new_keyframe for result in follow(registrar, frames(studio, path)))
    back = follow(registrar, frames(studio, [*[None] * 6, *[path[0]] * keyframes], first=13))
    found = [result for result in back if result.state is not State.LOST]
    assert (found[0].state, found[0].session) == (State.RELOCALISED, 0)


def test_sessions_of_the_input_and_those_that_begin_by_themselves_never_share_a_number(studio, hall):
    config = CONFIG.replace({"keyframes.lost_timeout_s": 0.1})
    registrar = Registrar(config)
    room, other = frames(studio, poses(0, 2)), frames(hall, ELSEWHERE[:2])
    shown = [(room[0], 0), (other[0], 0), (room[1], 0), (other[1], 1), (room[0], 1), (room[1], 4)]
    results = [
        registrar.step(replace(frame, stamp_ns=START_NS + k * NS_PER_S), session=number)
        for k, (frame, number) in enumerate(shown)
    ]
    assert states(results) == ["STARTED"] * 6
    assert [result.session for result in results] == [0, 1, 2, 3, 4, 7]
    assert (registrar.session, registrar.own_sessions) == (7, 3)


def test_a_clock_that_was_set_back_ends_the_wait_too(studio, hall):
    """By an hour: the time without a pose counts from the first stamp after it."""
    registrar = Registrar(CONFIG)
    follow(registrar, frames(studio, poses(0, 2)))
    back = [replace(frame, stamp_ns=START_NS - 3600 * NS_PER_S + k * NS_PER_S)
            for k, frame in enumerate(frames(hall, ELSEWHERE))]  # fmt: skip
    assert states(follow(registrar, back)) == ["LOST"] * 3 + ["STARTED"] + ["TRACKING"] * 2


def test_a_time_budget_that_a_search_uses_up_does_not_keep_it_lost(studio, hall, monkeypatch):
    registrar = Registrar(CONFIG.replace({"time_budget_s": 60.0, "keyframes.lost_timeout_s": 0.15}))
    follow(registrar, frames(studio, poses(0, 2)))

    def endless(*_):
        raise OutOfTime("the time budget of 60 s was used up before cliques")

    monkeypatch.setattr("vigg_ros.tracking.registrar.register", endless)
    results = follow(registrar, frames(hall, ELSEWHERE[:3], first=2))
    assert [result.reason for result in results] == ["TIMEOUT", "", "TIMEOUT"]
    assert results[1].state is State.STARTED


@pytest.mark.parametrize("number", [None, 3], ids=["reset", "a new session of the input"])
def test_a_reset_or_a_new_session_of_the_input_starts_another_session(number, studio):
    sequence = frames(studio, poses(0, 4))
    registrar = Registrar(CONFIG)
    before = follow(registrar, sequence[:2])
    if number is None:
        registrar.reset()
        assert registrar.reference is None
    after = [registrar.step(frame, session=number) for frame in sequence[2:]]
    assert states(before + after) == ["STARTED", "TRACKING", "STARTED", "TRACKING"]
    np.testing.assert_array_equal(after[0].T_odom_frame, np.eye(4))
    assert [result.session for result in before + after] == [0, 0, number or 1, number or 1]


def test_an_unusable_first_frame_starts_nothing(studio):
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


def test_an_answer_is_never_the_identity_unless_the_camera_stood_still(studio):
    """Each frame is 2 m and a turn from the last: no pose at all, or the right one."""
    back, aside = look_at((1.2, -0.9, 1.5), (-2, 1.2, 0.6)), look_at((0, 0.8, 1.2), (0, -2, 1))
    jumps = [looking(), back, looking((0.1, 0, 0)), aside]
    for result, pose in zip(follow(Registrar(CONFIG), frames(studio, jumps))[1:], jumps[1:], strict=True):
        if result.T_odom_frame is None:
            assert result.state is State.LOST
        else:
            assert errors(result.T_odom_frame, np.linalg.inv(jumps[0]) @ pose)[1] < 0.05


def test_the_buffer_stays_bounded(studio):
    """A keyframe for every frame, and room for three."""
    registrar = Registrar(CONFIG.replace({"keyframes.buffer_size": 3, "keyframes.min_overlap": 1.0}))
    path = poses(0, 8)
    results = follow(registrar, frames(studio, path))
    assert all(result.new_keyframe for result in results)
    assert [result.keyframe_id for result in results] == [0, 0, 1, 2, 3, 4, 5, 6]
    assert len(registrar._keyframes) == 3
    assert_on_the_path(results, path, origin=path[0])


@pytest.mark.parametrize("dark", [None, 1], ids=["always seen", "lost before"])
def test_a_reference_out_of_sight_is_replaced_by_the_last_frame(dark, studio):
    """Keyframes are taken so late that the reference no longer suffices; the last frame does, and becomes one."""
    late = {"min_overlap": 0.05, "min_inliers": 3, "max_translation_m": 100.0, "max_rotation_deg": 180.0, "retries": 0}
    config = CONFIG.replace(
        {"acceptance.min_overlap": 0.5, **{f"keyframes.{name}": value for name, value in late.items()}}
    )
    path = [looking((0, 0.1 * k, 0), (0, 0.25 * k, 0)) for k in range(7)]
    shown = [None if k == dark else pose for k, pose in enumerate(path)]
    results = follow(Registrar(config), frames(studio, shown))
    seen = [k for k in range(7) if k != dark]
    assert states(results[k] for k in seen) == ["STARTED"] + ["TRACKING"] * (len(seen) - 1)
    assert not any(result.new_keyframe for result in results[1:])
    assert len({results[k].keyframe_id for k in seen}) > 1
    assert_on_the_path([results[k] for k in seen], [path[k] for k in seen], origin=path[0])


def test_a_result_shows_what_was_compared(studio):
    first, second, third = follow(Registrar(CONFIG), frames(studio, [*poses(0, 2), None]))
    assert first.compared.keyframe is None
    assert second.compared.keyframe.id == second.keyframe_id
    assert isinstance(second.outcome, Registration)
    compared = second.compared.keyframe.features.keypoints, second.compared.features.keypoints
    for keypoints, pixels in zip(compared, np.hsplit(second.outcome.visual_inliers_px, 2), strict=True):
        assert set(map(tuple, pixels.tolist())) <= set(map(tuple, keypoints.pixels.tolist()))
    assert len(third.compared.features.keypoints) == 0
    kept = second.kept()
    assert (kept.compared, kept.outcome.visual_inliers_px.shape) == (None, (0, 4))
    assert (kept.T_odom_frame is second.T_odom_frame, kept.evidence) == (True, second.evidence)


def test_a_frame_whose_time_is_up_is_lost_and_the_next_one_is_not(studio):
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
