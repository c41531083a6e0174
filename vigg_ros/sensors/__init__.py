# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From messages to observations, online and offline: arrays with finite numbers, or a DataError."""
