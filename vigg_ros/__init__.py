# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""vigg_ros: registration of camera frames with depth, by visual-geometric mutual guidance (ViGG)."""

__version__ = "0.1.0"
