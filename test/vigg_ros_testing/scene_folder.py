# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The camera of the folder of a few small views that the tests of the commands share."""

from vigg_ros.registration.camera import Camera

VIEWED_BY = Camera(160, 120, 131.0, 131.0, 79.5, 59.5)
INTRINSICS = ["--intrinsics", "131", "131", "79.5", "59.5"]
"""The same for the command line."""
