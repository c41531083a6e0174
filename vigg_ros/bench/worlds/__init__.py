# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rendered worlds: scenes, cameras, LiDARs and motions whose truth is known in closed form."""

from vigg_ros.bench.worlds.ambiguous_scenes import (
    HALL_PERIOD_M,
    bare_room,
    blank_plane,
    hall_of_columns,
    single_plane,
    tiled_room,
)
from vigg_ros.bench.worlds.interiors import DOOR_M, kitchen_row, shelf, workshop
from vigg_ros.bench.worlds.lidar import LidarModel, LidarScan, render_lidar, scan_lidar
from vigg_ros.bench.worlds.paths import Drive, HandheldLoop, Leg, stamps_ns
from vigg_ros.bench.worlds.render import RollingShutter, render_depth, render_image, render_rgbd
from vigg_ros.bench.worlds.rooms import room
from vigg_ros.bench.worlds.scene import Light, Scene
from vigg_ros.bench.worlds.sensor_noise import ImageNoise, KinectNoise, StereoNoise
from vigg_ros.bench.worlds.streets import STREET_DRIVE, street

__all__ = [
    "DOOR_M", "HALL_PERIOD_M", "STREET_DRIVE", "Drive", "HandheldLoop", "ImageNoise", "KinectNoise", "Leg",
    "LidarModel", "LidarScan", "Light", "RollingShutter", "Scene", "StereoNoise", "bare_room", "blank_plane",
    "hall_of_columns", "kitchen_row", "render_depth", "render_image", "render_lidar", "render_rgbd", "room",
    "scan_lidar", "shelf", "single_plane", "stamps_ns", "street", "tiled_room", "workshop",
]  # fmt: skip
