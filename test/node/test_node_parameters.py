# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node's parameters, without ROS: what is accepted, coerced, suggested, and refused together."""

import re

import numpy as np
import pytest
import yaml

from vigg_ros.node.parameter_files import notes_on_files, unmatched_nodes
from vigg_ros.node.settings import SHORT_NAMES, NodeOptions, Settings, parameters_table, parse_extrinsics
from vigg_ros.registration.config import Config
from vigg_ros.registration.errors import ConfigError


def test_options_of_the_method_stand_over_the_preset():
    assert Settings.resolve({}) == Settings(NodeOptions(), Config.preset("rgbd"))
    settings = Settings.resolve({"config": "lidar", "visual.top_k": 99, "use_sim_time": True})
    assert settings.config == Config.preset("lidar").replace({"visual.top_k": 99})


def test_a_file_is_taken_as_a_preset_is(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("preset: lidar\nvisual:\n  top_k: 77\n")
    assert Settings.resolve({"config": str(path)}).config == Config.preset("lidar").replace({"visual.top_k": 77})


@pytest.mark.hostile("Parameters: Integer for a double A")
def test_an_integer_is_taken_for_a_real_number():
    settings = Settings.resolve({"max_rate": 10, "pairing.sync_slop_s": 1})
    assert (settings.options.max_rate, settings.config.pairing.sync_slop_s) == (10.0, 1.0)
    assert type(settings.options.max_rate) is float


@pytest.mark.hostile("Parameters: NaN or out of range F, or refused at run time with the old value kept")
@pytest.mark.hostile("Parameters: unknown key F with a suggestion")
@pytest.mark.hostile("Parameters: inconsistent set refused as a whole")
@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"max_rate": float("nan")}, "max_rate is nan, expected 0.0 to 1000.0 Hz"),
        ({"tf_timeout": -0.1}, "tf_timeout is -0.1, expected 0.0 to 10.0 s"),
        ({"publish_tf": 1}, "publish_tf is 1, expected bool"),
        ({"geometry": "cloud"}, "geometry is 'cloud', expected one of points, depth"),
        ({"max_rate": "fast"}, "max_rate is 'fast', expected float"),
        ({"geometri": "depth"}, "unknown parameter 'geometri'; did you mean geometry?"),
        ({"top_k": 100}, "did you mean visual.top_k?"),
        ({"sync_slopp": 0.02}, "did you mean sync_slop?"),
        ({"zzz": 1}, "`registrar --parameters` lists all of them"),
        ({"extrinsics": "1 2 3"}, "expected tf or seven numbers"),
        ({"extrinsics": [0.0, 0, 0, 0, 0, 0, 0]}, "quaternion"),
        ({"extrinsics": "0 0 0 0 0 0 nan"}, "expected tf or seven numbers"),
        ({"geometry": "depth", "extrinsics": "0 0 0 0 0 0 1"}, "but base_frame is empty"),
        ({"base_frame": "odom"}, "odom_frame and base_frame are both 'odom'"),
        ({"odom_frame": ""}, "odom_frame is empty"),
        ({"save_at_exit": True}, "save_at_exit is on, but output_dir is empty"),
        ({"output_dir": "/nowhere/at/all"}, "which is no folder"),
        ({"config": "rgdb"}, "expected a YAML file that exists or one of rgbd, lidar"),
        ({"geometric.min_range_m": 9.0, "geometric.max_range_m": 3.0}, "the first must be below the second"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_refused_with_its_name(given, said):
    with pytest.raises(ConfigError, match=re.escape(said)):
        Settings.resolve(given)


@pytest.mark.parametrize("given", ["0.6 0.1 -0.4 0 0 0.6 0.8", "[0.6, 0.1, -0.4, 0, 0, 0.6, 0.8]"])
def test_extrinsics_are_read_as_text(given):
    T_parent_camera = parse_extrinsics(given)
    # The rotation of (0, 0, 0.6, 0.8) about z by hand: cos = 0.64 - 0.36, sin = 2 * 0.48.
    np.testing.assert_allclose(T_parent_camera[:2, :2], [[0.28, -0.96], [0.96, 0.28]], atol=1e-12)
    np.testing.assert_allclose(T_parent_camera[:3, 3], [0.6, 0.1, -0.4])


def test_extrinsics_are_read_as_numbers_and_inverted_for_the_points():
    settings = Settings.resolve({"extrinsics": [1, 2, 3, 0, 0, 0, 1]})
    np.testing.assert_allclose(settings.T_camera_points[:3, 3], [-1, -2, -3])
    assert Settings.resolve({}).T_camera_points is None


def test_a_change_keeps_the_rest_and_a_bad_one_changes_nothing():
    settings = Settings.resolve({"geometry": "depth", "visual.top_k": 99})
    changed = settings.replace({"max_rate": 5})
    assert (changed.options.max_rate, changed.options.geometry, changed.config.visual.top_k) == (5.0, "depth", 99)
    with pytest.raises(ConfigError):
        settings.replace({"max_rate": 5.0, "visual.top_k": 0})
    assert settings.options.max_rate == 0.0


@pytest.mark.hostile("Parameters: file that matches no node N")
@pytest.mark.parametrize(
    ("content", "node", "others"),
    [
        ("registrar: {ros__parameters: {a: 1}}", "/registrar", []),
        ("/registrar: {ros__parameters: {a: 1}}", "/registrar", []),
        ("/**: {ros__parameters: {a: 1}}", "/robot/registrar", []),
        ("/**/registrar: {ros__parameters: {a: 1}}", "/a/b/registrar", []),
        ("/*/registrar: {ros__parameters: {a: 1}}", "/robot/registrar", []),
        ("robot: {registrar: {ros__parameters: {a: 1}}}", "/robot/registrar", []),
        ("/*: {ros__parameters: {a: 1}}", "/robot/registrar", ["*"]),
        ("registrar: {ros__parameters: {a: 1}}", "/robot/registrar", ["registrar"]),
        ("other: {ros__parameters: {a: 1}}\nthird: {ros__parameters: {}}", "/registrar", ["other", "third"]),
        ("[]", "/registrar", []),
    ],
)
def test_a_file_for_other_nodes_is_recognised(content, node, others):
    assert unmatched_nodes(yaml.safe_load(content), node) == others


def test_every_parameter_stands_in_the_table_with_when_to_touch_it():
    table = parameters_table()
    for parameter in Settings().parameters():
        assert f"| `{parameter.name}`" in table
        assert parameter.doc
    dynamic = {parameter.name for parameter in Settings().parameters() if parameter.is_dynamic}
    assert dynamic == {"max_rate", "time_budget"}
    assert "`max_rate` (dynamic)" in table


@pytest.mark.parametrize("long", SHORT_NAMES)
def test_options_that_users_set_most_have_short_names(long):
    short, defaults = SHORT_NAMES[long], {one.name: one.default for one in Settings().parameters()}
    assert long not in defaults
    default = defaults[short]
    value = "undistort" if short == "rectify" else default + 0.5 if isinstance(default, float) else default + 1
    one, other = (Settings.resolve({name: value}) for name in (short, long))
    assert one == other != Settings()
    with pytest.raises(ConfigError, match=f"{short} and {long} are the same parameter"):
        Settings.resolve({short: value, long: value})


def notes(path):
    return list(notes_on_files(["--params-file", str(path)], "/registrar"))


ODD = [("registrar", value, 0) for value in ("=", "!foo odom", "2024-13-45", "\x07")]


@pytest.mark.parametrize(("section", "value", "count"), [("front_camera", "map", 1), *ODD])
def test_a_file_for_another_node_is_noted_and_what_only_rcl_can_read_is_no_error(section, value, count, tmp_path):
    path = tmp_path / "odd.yaml"
    path.write_text(f"{section}:\n  ros__parameters:\n    odom_frame: {value}\n")
    assert len(notes(path)) == count


def test_a_file_that_is_gone_or_no_text_gives_no_note(tmp_path):
    path = tmp_path / "gone.yaml"
    assert notes(path) == []
    path.write_bytes(b"\xff\xfe\x00")
    assert notes(path) == []
