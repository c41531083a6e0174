# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Online operation without ROS: what the node does besides speaking ROS, each room testable on its own."""
