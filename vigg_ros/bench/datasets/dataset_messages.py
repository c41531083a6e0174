# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The messages that stand for a data set in a bag, as a camera's or LiDAR's driver would publish them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bags.trajectories import DatasetPose
from vigg_ros.bench.datasets.dataset import Dataset, DatasetFile, load_depth_raw, load_image, load_scan
from vigg_ros.messages.fields import Message
from vigg_ros.messages.pose_messages import encode_pose, encode_tf, encode_transform
from vigg_ros.messages.sensor_messages import encode_camera_info, encode_image, encode_points
from vigg_ros.registration import Camera

WORLD_FRAME = "map"
CAMERA_FRAME = "camera_color_optical_frame"
LIDAR_FRAME = "velodyne"

IMAGE_TOPIC = "/camera/color/image_raw"
RECTIFIED_IMAGE_TOPIC = "/camera/color/image_rect_color"
CAMERA_INFO_TOPIC = "/camera/color/camera_info"
DEPTH_TOPIC = "/camera/aligned_depth_to_color/image_raw"
POINTS_TOPIC = "/velodyne_points"
GROUND_TRUTH_TOPIC = "/ground_truth/pose"
TF_STATIC_TOPIC = "/tf_static"


@dataclass(frozen=True, slots=True)
class PlannedMessage:
    """A message to come; ``make`` loads its file, and raises BagError when that cannot be read."""

    stamp_ns: int
    topic: str
    make: Callable[[], Message]


def dataset_messages(dataset: Dataset) -> list[PlannedMessage]:
    """All messages of a data set by stamp.

    Colour as bgr8 with a CameraInfo each; depth as 16UC1 millimetres if the data set has these, else as
    32FC1 metres, which lose nothing; scans with intensity; the pose of the camera or LiDAR in ``map``.
    """
    planned = [
        *_images(dataset),
        *(PlannedMessage(file.stamp_ns, DEPTH_TOPIC, partial(_depth, dataset, file)) for file in dataset.depths),
        *(PlannedMessage(file.stamp_ns, POINTS_TOPIC, partial(_points, file)) for file in dataset.scans),
        *(PlannedMessage(pose.stamp_ns, GROUND_TRUTH_TOPIC, partial(_pose, pose)) for pose in dataset.poses),
    ]
    planned.sort(key=lambda message: message.stamp_ns)
    if dataset.T_lidar_camera is None:
        return planned
    first_ns = planned[0].stamp_ns
    make = partial(_static_transform, dataset.T_lidar_camera, first_ns)
    return [PlannedMessage(first_ns, TF_STATIC_TOPIC, make), *planned]


def _images(dataset: Dataset) -> Iterator[PlannedMessage]:
    topic = RECTIFIED_IMAGE_TOPIC if dataset.scans else IMAGE_TOPIC
    camera = dataset.camera
    for file in dataset.images:
        info = partial(encode_camera_info, camera, stamp_ns=file.stamp_ns, frame_id=CAMERA_FRAME)
        yield PlannedMessage(file.stamp_ns, CAMERA_INFO_TOPIC, info)
        yield PlannedMessage(file.stamp_ns, topic, partial(_image, camera, file))


def _image(camera: Camera, file: DatasetFile) -> Message:
    return encode_image(load_image(file.path, camera), stamp_ns=file.stamp_ns, frame_id=CAMERA_FRAME)


def _depth(dataset: Dataset, file: DatasetFile) -> Message:
    depth: NDArray[Any] = load_depth_raw(file.path, dataset.camera)
    if dataset.depth_unit_m != 0.001:
        depth = depth * np.float32(dataset.depth_unit_m)
    return encode_image(depth, stamp_ns=file.stamp_ns, frame_id=CAMERA_FRAME)


def _pose(pose: DatasetPose) -> Message:
    return encode_pose(pose.T_world_sensor, stamp_ns=pose.stamp_ns, frame_id=WORLD_FRAME)


def _static_transform(T_lidar_camera: NDArray[np.float64], stamp_ns: int) -> Message:
    transform = encode_transform(T_lidar_camera, stamp_ns=stamp_ns, frame_id=LIDAR_FRAME, child_frame_id=CAMERA_FRAME)
    return encode_tf([transform])


def _points(file: DatasetFile) -> Message:
    """A PointCloud2 of x y z and intensity as the Velodyne's driver lays it out."""
    scan = load_scan(file.path)
    cloud = encode_points(scan[:, :3], stamp_ns=file.stamp_ns, frame_id=LIDAR_FRAME)
    point_fields = tuple(
        Message("sensor_msgs/msg/PointField", {"name": name, "offset": 4 * column, "datatype": 7, "count": 1})
        for column, name in enumerate(("x", "y", "z", "intensity"))
    )
    layout = {"fields": point_fields, "point_step": 16, "row_step": 16 * len(scan)}
    data = np.ascontiguousarray(scan, dtype="<f4").reshape(-1).view(np.uint8)
    return Message(cloud.type, {**cloud.fields, **layout, "data": data})
