# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measuring: rendered worlds, data sets, methods to compare with, and their results. Nothing imports it."""
