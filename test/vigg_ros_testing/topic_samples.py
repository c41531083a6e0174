# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Topics by the names that real cameras use."""

from __future__ import annotations

from vigg_ros.bags.reader import Topic
from vigg_ros.bags.topics import TopicRequest, choose_topics

TYPES = {
    "image": "sensor_msgs/msg/Image",
    "compressed": "sensor_msgs/msg/CompressedImage",
    "info": "sensor_msgs/msg/CameraInfo",
    "points": "sensor_msgs/msg/PointCloud2",
    "pose": "geometry_msgs/msg/PoseStamped",
    "odometry": "nav_msgs/msg/Odometry",
    "tf": "tf2_msgs/msg/TFMessage",
    "imu": "sensor_msgs/msg/Imu",
}


def topics(*lines: str, count: int = 9) -> list[Topic]:
    """Topics of lines like "image /camera/image_raw"."""
    pairs = (line.split() for line in lines)
    return [Topic(name, TYPES[kind], count) for kind, name in pairs]


def chosen(held: list[Topic], **options) -> dict[str, str | None]:
    encodings = options.pop("encodings", {})
    choice = choose_topics(held, TopicRequest(**options), encodings=encodings)
    fields = ("image", "camera_info", "depth", "points", "ground_truth", "tf_static")
    taken = {field: getattr(choice, field) for field in fields}
    return {field: topic.name for field, topic in taken.items() if topic is not None}


REALSENSE = topics(
    "image /camera/color/image_raw",
    "compressed /camera/color/image_raw/compressed",
    "info /camera/color/camera_info",
    "image /camera/depth/image_rect_raw",
    "info /camera/depth/camera_info",
    "image /camera/aligned_depth_to_color/image_raw",
    "compressed /camera/aligned_depth_to_color/image_raw/compressedDepth",
    "info /camera/aligned_depth_to_color/camera_info",
    "image /camera/infra1/image_rect_raw",
    "info /camera/infra1/camera_info",
    "points /camera/depth/color/points",
    "imu /camera/imu",
    "tf /tf",
    "tf /tf_static",
)
