# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The border to files: rosbag2 and ROS 1 bags, read and written. Only here is rosbags imported."""
