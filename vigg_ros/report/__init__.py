# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Recorded bags through the same decode, pairing and Registrar as the node, and what a replay leaves behind."""
