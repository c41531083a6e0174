# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a message is for decides how it is decoded: the one way in, for the node and for bags."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

from vigg_ros.registration.options import InputConfig
from vigg_ros.sensors.camera_info import RectifyPolicy, decode_camera_info, images_on
from vigg_ros.sensors.colour_image import decode_image
from vigg_ros.sensors.compressed_depth import decode_compressed_depth
from vigg_ros.sensors.compressed_image import decode_compressed_image
from vigg_ros.sensors.depth_image import decode_depth
from vigg_ros.sensors.observation import Calibration, Note, Observation
from vigg_ros.sensors.point_cloud import decode_points
from vigg_ros.sensors.stamped_pose import decode_pose

Role = Literal["image", "camera_info", "depth", "points", "ground_truth"]

_CALIBRATION_CHANGED = Note(
    "CALIBRATION_CHANGED", "another calibration than before",
    "taken from here on; keyframes were dropped and a new session began",
    "if the camera did not change, look for a second publisher on the topic",
)


class InputDecoder:
    """Decodes the messages of one camera. Which topic carries its images says whether they are rectified."""

    def __init__(self, config: InputConfig, image_topic: str) -> None:
        policy: RectifyPolicy = config.rectify  # type: ignore[assignment]
        self._images = images_on(image_topic, policy)
        self._depth_scale_m = config.depth_scale_m or None
        self._calibration: Calibration | None = None

    def decode(self, role: Role, msg: Any) -> Observation:
        """The observation in a message of this role, raw or compressed. Raises DataError."""
        compressed = hasattr(msg, "format")
        if role == "image":
            return decode_compressed_image(msg) if compressed else decode_image(msg)
        if role == "camera_info":
            return self._compared(decode_camera_info(msg, images=self._images))
        if role == "points":
            return decode_points(msg)
        if role == "depth":
            read = decode_compressed_depth if compressed else decode_depth
            return read(msg, depth_scale_m=self._depth_scale_m)
        return decode_pose(msg)

    def _compared(self, calibration: Calibration) -> Calibration:
        """The calibration, with a note where the camera is another one than before."""
        old, self._calibration = self._calibration, calibration
        if old is None or old.same_camera(calibration):
            return calibration
        return replace(calibration, notes=(*calibration.notes, _CALIBRATION_CHANGED))
