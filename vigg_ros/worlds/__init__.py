# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rendered worlds: scenes, cameras, LiDARs and motions whose truth is known in closed form."""

from vigg_ros.worlds.lidar import LidarModel, LidarScan, render_lidar, scan_lidar
from vigg_ros.worlds.noise import ImageNoise, KinectNoise
from vigg_ros.worlds.paths import Drive, HandheldLoop, Leg, stamps_ns
from vigg_ros.worlds.render import render_depth, render_image, render_rgbd
from vigg_ros.worlds.rooms import room
from vigg_ros.worlds.scene import Light, Scene

__all__ = [
    "Drive",
    "HandheldLoop",
    "ImageNoise",
    "KinectNoise",
    "Leg",
    "LidarModel",
    "LidarScan",
    "Light",
    "Scene",
    "render_depth",
    "render_image",
    "render_lidar",
    "render_rgbd",
    "room",
    "scan_lidar",
    "stamps_ns",
]
