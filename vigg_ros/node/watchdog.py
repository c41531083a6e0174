# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Why nothing is published: for each input the first cause that blocks it, with its remedy."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

SILENCE_S = 3.5
"""So long nothing may be published before it is explained; with the periods of the timers this is within 5 s."""

TOPICS = {"image": "rgb/image", "camera_info": "rgb/camera_info", "depth": "depth/image", "points": "points"}
"""The names that are subscribed, by role, before remapping."""

PROFILE_REMEDY = (
    "large messages are lost on the way: publish reliably, or start publisher and node with "
    "FASTRTPS_DEFAULT_PROFILES_FILE=$(ros2 pkg prefix --share vigg_ros)/config/fastdds_shm.xml"
)


@dataclass(frozen=True, slots=True)
class Finding:
    """A cause, and what to do about it."""

    code: str
    topic: str
    found: str
    expected: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.topic}: found {self.found}, expected {self.expected}; {self.remedy} ({self.code})"


@dataclass(frozen=True, slots=True)
class Offer:
    """A publisher, as the graph describes it."""

    type: str
    reliable: bool


@dataclass(frozen=True, slots=True)
class InputFacts:
    """All that is known of one input."""

    role: str
    topic: str
    type: str
    """The type that is subscribed, such as sensor_msgs/msg/Image."""
    wants_reliable: bool
    offers: tuple[Offer, ...]
    age_s: float | None
    """Since the last message; None before the first."""
    last_refusal: str
    """Of the last message, empty if it was good."""
    good: int
    """Messages that could be used."""


@dataclass(frozen=True, slots=True)
class Facts:
    """All that is known while nothing is published."""

    inputs: Sequence[InputFacts]
    """The leading input first, then its partner, then the calibration."""
    slop_s: float
    offset_s: float | None
    """Measured from the leader's stamps to the partner's."""
    last_reason: str
    """Why the last frame had no pose: code, then text; empty if no frame came so far."""
    last_message: str
    busy: bool = False
    idle_topics: tuple[str, ...] = ()
    """Input topics of the other geometry that somebody publishes."""


def patience_s(max_rate_hz: float) -> float:
    """How long nothing may be published where frames are registered at this rate at most; 0 for all of them."""
    return SILENCE_S if max_rate_hz <= 0 else max(SILENCE_S, 1.5 / max_rate_hz)


def explain(facts: Facts) -> list[Finding]:
    """The causes, at most one for each input; those of the frames as a whole where every input is well."""
    inputs = [finding for one in facts.inputs for finding in [_of_input(one, facts)] if finding is not None]
    return inputs or list(_of_frames(facts))[:1]


def _of_input(one: InputFacts, facts: Facts) -> Finding | None:
    if not one.offers:
        return _no_publisher(one, facts)
    fitting = [offer for offer in one.offers if offer.type == one.type]
    if not fitting:
        return _wrong_type(one)
    if one.wants_reliable and not any(offer.reliable for offer in fitting):
        return Finding(
            "QOS_INCOMPATIBLE", one.topic, "publishers that offer best effort",
            "reliable, as the parameter qos asks", "set qos to auto or sensor_data",
        )
    if one.age_s is None or (one.role != "camera_info" and one.age_s >= SILENCE_S):
        return _nothing_arrives(one)
    if one.last_refusal and (not one.good or one.role != "camera_info"):
        return Finding("ALL_REFUSED", one.topic, "messages that cannot be used", "good ones", one.last_refusal)
    return None


def _no_publisher(one: InputFacts, facts: Facts) -> Finding:
    if one.role in ("points", "depth") and facts.idle_topics:
        other = "depth" if one.role == "points" else "points"
        remedy = f"set geometry to {other}: {facts.idle_topics[0]} has a publisher"
    else:
        remedy = f"start the driver, or remap: --ros-args -r {TOPICS[one.role]}:=/its/topic"
    code = "NO_CAMERA_INFO" if one.role == "camera_info" else "NO_PUBLISHER"
    return Finding(code, one.topic, "no publisher", f"one of {one.type}", remedy)


def _wrong_type(one: InputFacts) -> Finding:
    types = sorted({offer.type for offer in one.offers})
    compressed = any(kind.endswith("CompressedImage") for kind in (*types, one.type))
    if compressed and all(kind.startswith("sensor_msgs/msg/") and kind.endswith("Image") for kind in types):
        remedy = f"set image_transport to {'raw' if one.type.endswith('CompressedImage') else 'compressed'}, or to auto"
    else:
        remedy = f"remap {TOPICS[one.role]} to the right topic; `ros2 topic list -t` shows their types"
    return Finding("WRONG_TYPE", one.topic, f"publishers of {', '.join(types)}", one.type, remedy)


def _nothing_arrives(one: InputFacts) -> Finding:
    publishers = f"{len(one.offers)} publisher" + "s" * (len(one.offers) > 1)
    if one.age_s is None:
        code = "NO_CAMERA_INFO" if one.role == "camera_info" else "NOTHING_ARRIVES"
        remedy = f"check that it publishes; if so, {PROFILE_REMEDY}"
        return Finding(code, one.topic, f"{publishers}, but no message", "messages", remedy)
    return Finding(
        "INPUT_STOPPED", one.topic, f"no message for {one.age_s:.1f} s",
        "messages", "check the driver, or the end of the recording",
    )


def _of_frames(facts: Facts) -> Iterator[Finding]:
    leader, partner = facts.inputs[0], facts.inputs[1]
    apart = facts.offset_s is not None and abs(facts.offset_s) > facts.slop_s
    if apart and facts.last_reason in ("", "UNPAIRED"):
        assert facts.offset_s is not None, "checked by apart"
        yield Finding(
            "STAMPS_APART", leader.topic, f"stamps {_seconds(facts.offset_s)} from those of {partner.topic}",
            f"at most sync_slop, {facts.slop_s:g} s",
            "synchronise the clocks of the drivers, or raise sync_slop if the sensors are this far apart",
        )
    if facts.last_reason:
        yield Finding(
            facts.last_reason, leader.topic, "frames without a pose", "poses", facts.last_message or "see ~/status"
        )
    if facts.busy:
        remedy = "lower geometric.sample_k or visual.top_k"
        yield Finding("BUSY", leader.topic, "a registration that still runs", "an answer", remedy)
    yield Finding(
        "NO_FRAME", leader.topic, "messages but no frame yet", "pairs of messages", "wait, or see `vigg doctor`"
    )


def _seconds(offset_s: float) -> str:
    return f"{offset_s:+.3f} s" if abs(offset_s) >= 1 else f"{1e3 * offset_s:+.1f} ms"
