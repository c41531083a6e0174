# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What leaves as messages: the same ones for the node's topics and for bags."""
