# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Frames over time: pairing, keyframes, and the chain of poses. The only rooms with memory."""

from vigg_ros.tracking.assembly import FrameAssembler, Refusal, SyncedFrame, SyncedMessages
from vigg_ros.tracking.frame_result import Comparison, FrameResult, State
from vigg_ros.tracking.keyframes import Keyframe
from vigg_ros.tracking.registrar import Registrar

__all__ = [
    "Comparison", "FrameAssembler", "FrameResult", "Keyframe", "Refusal", "Registrar", "State",
    "SyncedFrame", "SyncedMessages",
]
