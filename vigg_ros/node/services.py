# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The services: reset, new keyframe, pause, save."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from vigg_ros.online.trail import SaveError


class Services:
    """Answers at once; nothing here waits for a registration."""

    def __init__(
        self,
        node: Node,
        *,
        reset: Callable[[], None],
        request_keyframe: Callable[[], None],
        pause: Callable[[bool], None],
        save: Callable[[], str],
    ) -> None:
        self._reset = reset
        self._request_keyframe = request_keyframe
        self._pause = pause
        self._save = save
        node.create_service(Trigger, "~/reset", self._on_reset)
        node.create_service(Trigger, "~/new_keyframe", self._on_new_keyframe)
        node.create_service(SetBool, "~/pause", self._on_pause)
        node.create_service(Trigger, "~/save_trajectory", self._on_save)

    def _on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._reset()
        response.success, response.message = True, "a new session begins with the next frame"
        return response

    def _on_new_keyframe(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._request_keyframe()
        response.success, response.message = True, "the next frame that is tracked becomes the reference keyframe"
        return response

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        self._pause(request.data)
        response.success, response.message = True, "paused" if request.data else "running"
        return response

    def _on_save(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            response.message = self._save()
            response.success = True
        except SaveError as error:
            response.success, response.message = False, str(error)
        return response
