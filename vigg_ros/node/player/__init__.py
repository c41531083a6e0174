# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bags over DDS: plays them, runs the node on them, and watches what it answers."""
