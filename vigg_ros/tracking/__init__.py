# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Frames over time: pairing, keyframes, and the chain of poses. The only rooms with memory."""

from vigg_ros.tracking.assembly import FrameAssembler, Refusal, SyncedFrame, SyncedMessages
from vigg_ros.tracking.keyframes import Keyframe
from vigg_ros.tracking.registrar import Attempt, Estimate, Registrar, State

__all__ = [
    "Attempt", "Estimate", "FrameAssembler", "Keyframe", "Refusal", "Registrar", "State", "SyncedFrame",
    "SyncedMessages",
]
