# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The hot loops, compiled; each stands beside a plain NumPy twin (``*_plain``) that the tests compare it with.

They take and return plain arrays and know nothing of frames or matches; see ``compilation`` for the cache.
"""
