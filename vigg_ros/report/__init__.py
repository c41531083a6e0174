# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a replay leaves behind, all from FrameResults: files, page, result bag, errors; and what is wrong with a bag."""
