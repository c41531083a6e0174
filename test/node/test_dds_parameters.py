# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the running node."""

import time

import pytest
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParametersAtomically
from rclpy.parameter import Parameter

from vigg_ros.node.settings import Settings
from vigg_ros_testing.registrar_process import ROOT, depth_arguments, parameters
from vigg_ros_testing.rendered_frames import frame, send_and_wait


@pytest.fixture(scope="module")
def running(start, tmp_path_factory):
    """A node with an integer for a real number, an option's old name, and a parameter file for another node."""
    path = tmp_path_factory.mktemp("parameters") / "other.yaml"
    path.write_text("front_camera:\n  ros__parameters:\n    geometry: points\n")
    given = {"max_rate": 0, "geometric__max_range_m": 6, "verification__min_overlap": 0.1}
    return start(*depth_arguments("--params-file", str(path), **given)).wait_until_ready()


def change(peer, **values):
    """Set parameters together, as `ros2 param set` does."""
    request = SetParametersAtomically.Request()
    request.parameters = [Parameter(n.replace("__", "."), value=v).to_parameter_msg() for n, v in values.items()]
    result = peer.request(SetParametersAtomically, "set_parameters_atomically", request).result
    return result.successful, result.reason


def value(peer, name):
    """The value of a number or text."""
    found = peer.request(GetParameters, "get_parameters", GetParameters.Request(names=[name])).values[0]
    return found.double_value if found.type == ParameterType.PARAMETER_DOUBLE else found.string_value


@pytest.mark.hostile("Parameters: Integer for a double A")
def test_an_integer_is_taken_for_a_real_number_at_start_and_later(running, peer):
    assert value(peer, "max_range") == 6.0
    assert change(peer, max_rate=7) == (True, "")
    assert value(peer, "max_rate") == 7.0
    assert change(peer, max_rate=0.0) == (True, "")


@pytest.mark.hostile("Parameters: NaN or out of range F, or refused at run time with the old value kept")
@pytest.mark.hostile("Parameters: inconsistent set refused as a whole")
@pytest.mark.hostile("Parameters: read-only refused")
@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"max_rate": float("nan")}, "max_rate"),
        ({"max_rate": -1.0}, "max_rate"),
        ({"max_rate": "fast"}, "Wrong parameter type"),
        ({"max_rate": 3.0, "time_budget": -1.0}, "time_budget"),
        ({"max_rate": 3.0, "odom_frame": "world"}, "read-only"),
    ],
)
def test_a_set_with_a_value_that_cannot_be_taken_changes_nothing(running, peer, values, words):
    successful, reason = change(peer, **values)
    assert not successful
    assert words in reason
    assert (value(peer, "max_rate"), value(peer, "odom_frame")) == (0.0, "odom")


@pytest.mark.hostile("Parameters: file that matches no node N")
def test_a_file_for_another_node_is_noted(running):
    line = running.wait_for("nothing of this file is used", 5.0)
    assert "found parameters of front_camera, expected /registrar" in line


def test_an_old_name_is_noted_in_a_line_of_the_log(running):
    line = running.wait_for("verification.min_overlap is called acceptance.min_overlap now", 5.0)
    assert "[WARN]" in line


def test_max_rate_skips_frames_by_their_stamps(running, peer):
    peer.clear()
    change(peer, max_rate=5.0)
    states = [send_and_wait(peer, frame(number))["state"] for number in range(7)]
    assert states == ["STARTED", "SKIPPED", "SKIPPED", "TRACKING", "SKIPPED", "SKIPPED", "TRACKING"]
    change(peer, max_rate=0.0)


@pytest.mark.slow
def test_the_silence_of_a_low_max_rate_is_no_error(running, peer):
    peer.call("reset")
    peer.clear()
    assert change(peer, max_rate=0.1)[0]
    assert send_and_wait(peer, frame(0))["state"] == "STARTED"
    end_s, number = time.monotonic() + 5.0, 0  # SILENCE_S and more, but less than a period
    while time.monotonic() < end_s:
        number += 1
        assert send_and_wait(peer, frame(number))["state"] == "SKIPPED"
        time.sleep(0.1)
    assert not peer.statuses("WAITING")
    assert change(peer, max_rate=0.0)[0]


def test_parameters_are_described_with_their_ranges(running, peer):
    known = list(Settings().parameters())
    request = DescribeParameters.Request(names=[one.name for one in known])
    descriptors = peer.request(DescribeParameters, "describe_parameters", request).descriptors
    for parameter, descriptor in zip(known, descriptors, strict=True):
        assert parameter.doc in descriptor.description
        assert descriptor.read_only == (not parameter.is_dynamic)
        ranges = [*descriptor.floating_point_range, *descriptor.integer_range]
        assert [(one.from_value, one.to_value) for one in ranges] == (
            [] if parameter.low is None else [(parameter.low, parameter.high)]
        )


def test_a_bad_start_is_one_line_and_exit_code_2(start):
    cases = {
        "tf_timeout is nan, expected 0.0 to 10.0 s": parameters(tf_timeout=".nan"),
        "the arguments after --ros-args cannot be used": ["-p", "geometry"],
        "is given as -p config:=FILE": ["--params-file", str(ROOT / "config" / "rgbd.yaml")],
    }
    started = {text: start(*arguments) for text, arguments in cases.items()}
    for text, node in started.items():
        assert node.exit_code() == 2
        lines = node.log.splitlines()
        own = [line for line in lines if "[rcl]" not in line]  # rcl has its say on arguments it cannot parse
        assert len(own) == 1, node.log
        assert own[0].startswith("registrar: ")
        assert text in own[0]
