# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From messages to observations: the one reader of each type, online and offline.

Messages are read by their attributes, so those of rclpy and of rosbags serve alike. Whatever a message
holds, the answer is an observation with finite numbers or a DataError. Images share the memory of their
message where the layout allows it.
"""

from vigg_ros.sensors.camera_info import Images, Policy, decode_camera_info, images_on
from vigg_ros.sensors.colour_image import decode_image
from vigg_ros.sensors.compressed_depth import decode_compressed_depth
from vigg_ros.sensors.compressed_image import decode_compressed_image
from vigg_ros.sensors.depth_image import decode_depth
from vigg_ros.sensors.header import stamp_ns
from vigg_ros.sensors.message_limits import MAX_PIXELS, MAX_POINTS, MAX_RANGE_M
from vigg_ros.sensors.point_cloud import decode_points
from vigg_ros.sensors.stamped_pose import decode_pose, decode_transform

__all__ = [
    "MAX_PIXELS",
    "MAX_POINTS",
    "MAX_RANGE_M",
    "Images",
    "Policy",
    "decode_camera_info",
    "decode_compressed_depth",
    "decode_compressed_image",
    "decode_depth",
    "decode_image",
    "decode_points",
    "decode_pose",
    "decode_transform",
    "images_on",
    "stamp_ns",
]
