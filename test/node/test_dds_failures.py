# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What fails inside the node costs one frame or one answer, never the node. It runs in this process, to be broken."""

import threading

import pytest
import rclpy
from dds_domain import own_domain
from std_srvs.srv import SetBool, Trigger

from vigg_ros.node.publishers import Publishers
from vigg_ros.node.registrar_node import RegistrarNode
from vigg_ros.node.services import create_services
from vigg_ros.pipeline import Pipeline
from vigg_ros_testing.registrar_process import START_TIMEOUT_S, depth_arguments
from vigg_ros_testing.rendered_frames import frame, send, send_and_wait, stamp_of_frame
from vigg_ros_testing.ros_peer import spinning, stamp_of


def breaking(owner, name, patch, *, times=10 ** 9):
    """Let a method fail so often, and then do what it did; the failures so far."""
    original, failures = getattr(owner, name), []

    def method(*arguments, **options):
        if len(failures) < times:
            failures.append(name)
            raise OSError(f"{name} is broken")
        return original(*arguments, **options)

    patch.setattr(owner, name, method)
    return failures


@pytest.fixture(scope="module")
def local_node():
    """The thread that spins a node."""
    context = rclpy.Context()
    rclpy.init(args=["registrar", "--ros-args", *depth_arguments()], context=context, domain_id=own_domain())
    node = RegistrarNode(context)
    node.start()
    with spinning(node.ros) as thread:
        assert node._scheduler.worker.ready.wait(START_TIMEOUT_S)
        yield thread
    assert node.end(30.0)
    node.ros.destroy_node()
    context.try_shutdown()


@pytest.fixture
def clean(local_node, peer):
    """The node with nothing left of the test before, and alive after the test."""
    peer.begin_anew()
    yield
    assert local_node.is_alive()
    assert peer.call("pause", data=False).success
    peer.withdraw()


@pytest.mark.usefixtures("clean")
def test_views_that_fail_do_not_answer_a_frame_twice(peer, monkeypatch):
    breaking(Publishers, "publish_views", monkeypatch)
    assert send_and_wait(peer, frame(0))["state"] == "STARTED"
    assert send_and_wait(peer, frame(1))["state"] == "TRACKING"
    assert [one["state"] for one in peer.answers()] == ["STARTED", "TRACKING"]


@pytest.mark.usefixtures("clean")
def test_a_refusal_that_cannot_be_told_does_not_end_the_node(peer, monkeypatch):
    failures = breaking(Publishers, "publish_status", monkeypatch, times=1)
    unusable = frame(0)
    unusable["/rgb/image"].fields["encoding"] = "nonsense"
    send(peer, unusable)
    peer.wait(lambda: failures, "the attempt to refuse the image")
    assert send_and_wait(peer, frame(1))["state"] == "STARTED"
    peer.wait(lambda: peer.heard["diagnostics"], "diagnostics")


@pytest.mark.usefixtures("clean")
def test_a_reset_during_a_registration_is_answered_at_once_and_discards_its_result(peer, monkeypatch):
    track, begun, go_on = Pipeline.track, threading.Event(), threading.Event()

    def held(*arguments, **options):
        begun.set()
        assert go_on.wait(30.0)
        return track(*arguments, **options)

    send_and_wait(peer, frame(0))
    with monkeypatch.context() as patch:
        patch.setattr(Pipeline, "track", held)
        send(peer, frame(1))
        assert begun.wait(30.0)
        assert peer.call("reset").success
        assert len(peer.answers()) == 1, "it still runs"
        go_on.set()
        peer.wait(lambda: len(peer.answers()) == 2, "the end of the registration")
    assert peer.answers()[-1]["state"] == "DISCARDED"
    assert [stamp_of(pose) for pose in peer.heard["pose"]] == [stamp_of_frame(0)]
    assert send_and_wait(peer, frame(2))["state"] == "STARTED"


def test_no_service_lets_an_exception_pass():
    callbacks = {}
    failures = []

    class Node:
        def create_service(self, kind, name, callback):
            callbacks[name] = (kind, callback)

    def broken(*arguments):
        raise RuntimeError("unforeseen")

    create_services(Node(), reset=broken, request_keyframe=broken, pause=broken, save=broken, failed=failures.append)
    assert {kind for kind, _ in callbacks.values()} == {Trigger, SetBool}
    for kind, callback in callbacks.values():
        response = callback(kind.Request(), kind.Response())
        assert (response.success, response.message) == (False, "internal error: RuntimeError: unforeseen")
    assert len(failures) == len(callbacks) == 4
