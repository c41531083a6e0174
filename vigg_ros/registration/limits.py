# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Limits that the configuration and the kernels share."""

MAX_CELLS_PER_AXIS = 2**20
"""Three axes of this many cells fit one int64 key, with a margin of one cell on each side."""
