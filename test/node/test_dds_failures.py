# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What fails inside the node costs one frame or one answer, never the node. It runs in this process, to be broken."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import pytest
import rclpy
from std_srvs.srv import SetBool, Trigger

from vigg_ros.node.publishers import Publishers
from vigg_ros.node.registrar_node import RegistrarNode
from vigg_ros.node.scheduler import Scheduler
from vigg_ros.node.services import Services
from vigg_ros_testing.dds_domain import own_domain
from vigg_ros_testing.registrar_process import depth_arguments
from vigg_ros_testing.rendered_frames import frame, send, send_and_wait
from vigg_ros_testing.ros_peer import Peer


class Broken:
    """Stands for a method; fails so often, then does what the method did."""

    def __init__(self, owner: type, name: str, patch: pytest.MonkeyPatch, *, times: int = 10**9) -> None:
        self.left = times
        original = getattr(owner, name)

        def method(*arguments: Any, **options: Any) -> Any:
            if self.left > 0:
                self.left -= 1
                raise OSError(f"{name} is broken")
            return original(*arguments, **options)

        patch.setattr(owner, name, method)


@pytest.fixture(scope="module")
def local_node() -> Iterator[threading.Thread]:
    """The thread that spins a node."""
    context = rclpy.Context()
    rclpy.init(args=["registrar", "--ros-args", *depth_arguments()], context=context, domain_id=own_domain())
    node = RegistrarNode(context)
    executor = rclpy.executors.SingleThreadedExecutor(context=context)
    executor.add_node(node.ros)
    ending = threading.Event()

    def spin() -> None:
        while not ending.is_set():
            executor.spin_once(timeout_sec=0.1)

    thread = threading.Thread(target=spin)
    node.start()
    thread.start()
    yield thread
    ending.set()
    thread.join()
    assert node.end(30.0)
    executor.shutdown()
    node.ros.destroy_node()
    context.try_shutdown()


@pytest.fixture
def clean(local_node: threading.Thread, peer: Peer) -> Iterator[None]:
    """The node with nothing left of the test before, and alive after the test."""
    peer.call("reset")
    peer.wait_briefly(lambda: False, 0.1)
    peer.clear()
    yield
    assert local_node.is_alive()
    assert peer.call("pause", data=False)[0].success
    peer.withdraw()


@pytest.mark.usefixtures("clean")
def test_views_that_fail_do_not_answer_a_frame_twice(peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    Broken(Publishers, "publish_views", monkeypatch)
    assert send_and_wait(peer, frame(0))["state"] == "STARTED"
    assert send_and_wait(peer, frame(1))["state"] == "TRACKING"
    assert [one["state"] for one in peer.answers()] == ["STARTED", "TRACKING"]


@pytest.mark.usefixtures("clean")
def test_a_pose_that_cannot_be_published_is_told_and_the_next_one_comes(
    peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    Broken(Publishers, "publish_pose", monkeypatch, times=1)
    first = send_and_wait(peer, frame(0))
    assert (first["state"], first["reason"]) == ("REFUSED", "INTERNAL_ERROR")
    assert send_and_wait(peer, frame(1))["state"] == "TRACKING"


@pytest.mark.usefixtures("clean")
def test_a_refusal_that_cannot_be_told_does_not_end_the_node(peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = Broken(Publishers, "publish_status", monkeypatch, times=1)
    unusable = frame(0)
    unusable["/rgb/image"].fields["encoding"] = "nonsense"
    send(peer, unusable)
    peer.wait(lambda: broken.left == 0, "the attempt to refuse the image")
    assert send_and_wait(peer, frame(1))["state"] == "STARTED"


@pytest.mark.usefixtures("clean")
def test_a_service_that_fails_says_so(peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    Broken(Scheduler, "reset", monkeypatch, times=1)
    response, _ = peer.call("reset")
    assert not response.success
    assert response.message == "internal error: OSError: reset is broken"
    assert peer.call("reset")[0].success


def test_no_service_lets_an_exception_pass() -> None:
    callbacks: dict[str, Any] = {}
    failures: list[BaseException] = []

    class Node:
        def create_service(self, kind: Any, name: str, callback: Any) -> None:
            callbacks[name] = (kind, callback)

    def broken(*arguments: object) -> Any:
        raise RuntimeError("unforeseen")

    Services(Node(), reset=broken, request_keyframe=broken, pause=broken, save=broken, failed=failures.append)  # type: ignore[arg-type]
    assert {kind for kind, _ in callbacks.values()} == {Trigger, SetBool}
    for kind, callback in callbacks.values():
        response = callback(kind.Request(), kind.Response())
        assert (response.success, response.message) == (False, "internal error: RuntimeError: unforeseen")
    assert len(failures) == len(callbacks) == 4
