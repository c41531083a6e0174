# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The services: reset, new keyframe, pause, save."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from vigg_ros.node.trajectory_log import SaveError


def create_services(
    node: Node,
    *,
    reset: Callable[[], object],
    request_keyframe: Callable[[], object],
    pause: Callable[[bool], object],
    save: Callable[[], str],
    failed: Callable[[BaseException], None],
) -> None:
    """Services that answer at once; nothing here waits for a registration."""

    def serve(kind: type, name: str, act: Callable[[Any], object]) -> None:
        """Act on each request and say so with what the action returns."""

        def answer(request: Any, response: Any) -> Any:
            try:
                response.success, response.message = True, act(request)
            except SaveError as error:
                response.success, response.message = False, str(error)
            except Exception as error:  # rclpy would end the process for it
                failed(error)
                response.success, response.message = False, f"internal error: {type(error).__name__}: {error}"
            return response

        node.create_service(kind, name, answer)

    serve(Trigger, "~/reset", lambda _: reset() or "a new session begins with the next frame")
    serve(
        Trigger,
        "~/new_keyframe",
        lambda _: request_keyframe() or "the next frame that is tracked becomes the reference keyframe",
    )
    serve(SetBool, "~/pause", lambda request: pause(request.data) or ("paused" if request.data else "running"))
    serve(Trigger, "~/save_trajectory", lambda _: save())
