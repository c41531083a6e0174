# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""May this answer be given? What speaks for it, what against it, and the limits."""

# First, whichever package is imported first: its vigg.py composes both.
import vigg_ros.registration  # noqa: F401
