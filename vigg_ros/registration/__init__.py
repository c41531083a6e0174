# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The method: arrays in, transform out. No time, no files, no ROS."""

from vigg_ros.registration.camera import Camera
from vigg_ros.registration.config import Config
from vigg_ros.registration.errors import BagError, ConfigError, DataError, ViggError
from vigg_ros.registration.features import Features
from vigg_ros.registration.frame import Frame
from vigg_ros.registration.result import Evidence, Outcome, Reason, Registration, Rejection
from vigg_ros.registration.vigg import extract, register

__all__ = [
    "BagError", "Camera", "Config", "ConfigError", "DataError", "Evidence", "Features", "Frame", "Outcome", "Reason",
    "Registration", "Rejection", "ViggError", "extract", "register",
]
