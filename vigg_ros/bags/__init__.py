# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The border to files: bags and data set folders. Only here is rosbags imported."""
