# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The services: reset, new keyframe, pause, save."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from vigg_ros.node.trajectory_log import SaveError


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
        failed: Callable[[BaseException], None],
    ) -> None:
        self._reset = reset
        self._request_keyframe = request_keyframe
        self._pause = pause
        self._save = save
        self._failed = failed
        node.create_service(Trigger, "~/reset", self._on_reset)
        node.create_service(Trigger, "~/new_keyframe", self._on_new_keyframe)
        node.create_service(SetBool, "~/pause", self._on_pause)
        node.create_service(Trigger, "~/save_trajectory", self._on_save)

    def _on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._answer(response, self._reset, "a new session begins with the next frame")

    def _on_new_keyframe(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        text = "the next frame that is tracked becomes the reference keyframe"
        return self._answer(response, self._request_keyframe, text)

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        return self._answer(response, lambda: self._pause(request.data), "paused" if request.data else "running")

    def _on_save(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._answer(response, self._save)

    def _answer(self, response: Any, act: Callable[[], str | None], text: str = "") -> Any:
        """Act and say so: with what the action returns, or else this text."""
        try:
            response.message = act() or text
            response.success = True
        except SaveError as error:
            response.success, response.message = False, str(error)
        except Exception as error:  # rclpy would end the process for it
            self._failed(error)
            response.success, response.message = False, f"internal error: {type(error).__name__}: {error}"
        return response
