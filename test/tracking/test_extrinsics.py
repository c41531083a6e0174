# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Chains of static transforms."""


import numpy as np
import pytest

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import choose_topics
from vigg_ros.bench.worlds.poses import T_BODY_OPTICAL, flat
from vigg_ros.messages.sensor_messages import encode_camera_info, encode_image, encode_points
from vigg_ros.pipeline import Pipeline
from vigg_ros.registration.config import Config
from vigg_ros.registration.errors import DataError
from vigg_ros.registration.rigid import inverse
from vigg_ros.report.bag_messages import read_extrinsics, read_messages
from vigg_ros.tracking.extrinsics import StaticTree, fixed
from vigg_ros.tracking.frame_result import State
from vigg_ros_testing.bag_samples import CAMERA, COLOUR, INFO, START_NS, entry, tf_static_entry, write_bag

EMPTY_ROW = pytest.mark.hostile("Frames and TF: Empty frame_id N with extrinsics by parameter, else R")

T_BASE_LIDAR = flat((0.1, 0.0, 1.9), 2.0)
T_BASE_MAST = flat((0.5, 0.2, 1.0), 30.0)
T_MAST_CAMERA = flat((0.0, 0.0, 0.4), -31.0)


def car():
    """base_link holds lidar and mast, the mast a camera, the camera its optical frame."""
    tree = StaticTree()
    tree.add("camera", "optical", T_BODY_OPTICAL)
    tree.add("base_link", "lidar", T_BASE_LIDAR)
    tree.add("mast", "camera", T_MAST_CAMERA)
    tree.add("base_link", "mast", T_BASE_MAST)
    return tree


def assert_same(actual, expected):
    # A product of four rotations keeps all but the last digits.
    np.testing.assert_allclose(actual, expected, atol=1e-14)


def test_a_chain_goes_up_and_down_the_tree():
    assert_same(car().lookup("base_link", "lidar"), T_BASE_LIDAR)
    assert_same(car().lookup("lidar", "base_link"), inverse(T_BASE_LIDAR))
    T_base_optical = T_BASE_MAST @ T_MAST_CAMERA @ T_BODY_OPTICAL
    assert_same(car().lookup("optical", "lidar"), inverse(T_base_optical) @ T_BASE_LIDAR)


def test_a_known_point_is_seen_where_it_stands():
    """3 m before and 0.1 m above a camera that looks along the car's x axis, 1.4 m high."""
    tree = StaticTree()
    tree.add("base_link", "optical", flat((0.5, 0.0, 1.4)) @ T_BODY_OPTICAL)
    T_optical_base = tree.lookup("optical", "base_link")
    np.testing.assert_allclose(T_optical_base @ (3.5, 0.0, 1.5, 1.0), (0.0, -0.1, 3.0, 1.0), atol=1e-15)


def test_frames_that_nothing_connects_have_no_transform():
    tree = car()
    tree.add("trailer", "rear_lidar", T_BASE_LIDAR)
    assert tree.lookup("optical", "rear_lidar") is None
    assert tree.lookup("optical", "unheard_of") is None
    assert tree.lookup("unheard_of", "optical") is None
    assert StaticTree().lookup("a", "b") is None


@pytest.mark.parametrize("name", ["lidar", "unheard_of"])
def test_a_frame_is_where_it_is_itself(name):
    """Also one that no link names: a driver may publish the points in the camera's frame."""
    assert_same(car().lookup(name, name), np.eye(4))


def test_the_latest_of_two_transforms_for_a_link_holds():
    tree = car()
    tree.add("base_link", "lidar", flat((9.0, 0.0, 0.0)))
    assert_same(tree.lookup("base_link", "lidar"), flat((9.0, 0.0, 0.0)))
    assert_same(tree.lookup("lidar", "base_link"), flat((-9.0, 0.0, 0.0)))


def test_a_loop_of_links_ends_with_the_shortest_chain():
    tree = car()
    tree.add("lidar", "optical", flat((1.0, 2.0, 3.0)))
    assert_same(tree.lookup("lidar", "optical"), flat((1.0, 2.0, 3.0)))
    assert tree.lookup("lidar", "unheard_of") is None


@EMPTY_ROW
@pytest.mark.parametrize(("target", "source"), [("", ""), ("", "lidar"), ("lidar", "")])
def test_a_frame_without_a_name_is_nowhere(target, source):
    """Least of all where the other one without a name is: two drivers that fill in nothing are not one sensor."""
    with pytest.raises(DataError, match=r"the names of two frames in TF.*or give the extrinsics") as caught:
        car().lookup(target, source)
    assert caught.value.code == "FRAME_ID_EMPTY"


def replayed_without_names(folder, extrinsics):
    """What a replay says of a bag with /tf_static whose image and scan have no frame_id; and its notes."""
    header = {"stamp_ns": START_NS, "frame_id": ""}
    # A grid that a camera without any offset from the scanner sees: only the names are wrong.
    points = np.stack(np.meshgrid(np.linspace(-1, 1, 10), np.linspace(-0.8, 0.8, 10), [3.0]), -1).reshape(-1, 3)
    sent = {
        INFO: encode_camera_info(CAMERA, **header),
        COLOUR: encode_image(np.zeros((6, 8), np.uint8), **header),
        "/points": encode_points(points, **header),
    }
    entries = [tf_static_entry(), *(entry(topic, message, START_NS) for topic, message in sent.items())]
    with BagReader(write_bag(folder, entries)) as reader:
        choice = choose_topics(reader.topics)
        tree = read_extrinsics(reader, choice)
        pipeline = Pipeline(Config.preset("lidar"), extrinsics or tree.lookup)
        results = [result for role, message in read_messages(reader, choice) for result in pipeline.feed(role, message)]
    (result,) = [*results, *pipeline.flush()]
    return result, [code for _, code in pipeline.notes]


@EMPTY_ROW
def test_a_bag_without_frame_names_is_refused_unless_the_extrinsics_are_given(tmp_path):
    refused, _ = replayed_without_names(tmp_path / "tf", None)
    assert (refused.state, refused.reason, refused.T_odom_frame) == (State.REFUSED, "FRAME_ID_EMPTY", None)
    taken, notes = replayed_without_names(tmp_path / "given", fixed(np.eye(4)))
    assert taken.reason == "NO_TEXTURE"  # so far it came: the image is black
    assert notes == ["FRAME_ID_EMPTY"] * 3
