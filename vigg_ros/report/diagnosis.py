# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a bag holds, and whether it can be replayed: stamps of all messages, content of a few."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.rhythm import Rhythm, find_rhythms
from vigg_ros.bags.topics import (
    CAMERA_INFO_TYPES,
    AmbiguousTopicError,
    TopicChoice,
    TopicError,
    TopicRequest,
    choose_topics,
)
from vigg_ros.registration.config import Config
from vigg_ros.report.bag_messages import Sample, suggest_preset, take_samples
from vigg_ros.report.findings import DoctorFinding, check_frames, check_pairing, check_samples
from vigg_ros.tracking.extrinsics import Lookup

MAX_ALTERNATIVE_CHOICES = 8
"""So many choices of topics are listed for an ambiguous bag."""

AMBIGUOUS = DoctorFinding(
    "several topics could be meant; what follows holds for the first of the commands below",
    "choose one of the commands, or name the topics",
)


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Everything the page says."""

    rhythms: Mapping[str, Rhythm]
    findings: Sequence[DoctorFinding]
    samples: Sequence[Sample] = ()
    fit: Sequence[str] = ()
    """Sentences on how stamps and geometry of the chosen sensors fit together."""
    preset: str = "rgbd"
    replays: Sequence[TopicRequest] = ()
    """The topics to ask for; several where several could be meant, none where nothing can be replayed."""


def diagnose(
    reader: BagReader,
    requested: TopicRequest,
    *,
    find_config: Callable[[str], Config],
    find_extrinsics: Callable[[TopicChoice], Lookup | None],
) -> Diagnosis:
    """Examine an open bag. The losses of the reader are complete afterwards, but for what was not decoded.

    ``find_config`` gives the configuration by the preset that suits the bag, ``find_extrinsics`` where the points are
    in the camera's frame: None if neither the user nor the bag says.
    """
    try:
        choices = find_choices(reader, requested)
    except TopicError as error:
        return Diagnosis(find_rhythms(reader.stamps()), missing_topics(reader, error))
    choice = choices[0][1]
    samples = take_samples(reader, choice, find_config("rgbd").input)
    preset = suggest_preset(samples)
    extrinsics = None if choice.points is None else find_extrinsics(choice)
    entries = reader.stamps()  # after the samples, so that the reader's losses are those of a whole reading
    fit, findings = check_frames(samples, extrinsics)
    timing, pairing = check_pairing(entries, choice, find_config(preset).pairing)
    ambiguous = [AMBIGUOUS] if len(choices) > 1 else []
    findings = [*ambiguous, *check_samples(samples), *findings, *pairing]
    blocked = any(finding.blocks for finding in findings)
    return Diagnosis(
        rhythms=find_rhythms(entries),
        samples=tuple(samples.values()),
        fit=[*fit, *timing],
        findings=findings,
        preset=preset,
        replays=[request for request, _ in choices] if not blocked or ambiguous else (),
    )


def find_choices(reader: BagReader, requested: TopicRequest) -> list[tuple[TopicRequest, TopicChoice]]:
    """Each way to choose topics, with the request that leads to it; several if they are ambiguous.

    Raises TopicError when a topic is missing.
    """
    encodings = reader.encodings()
    waiting = [requested]
    found: list[tuple[TopicRequest, TopicChoice]] = []
    while waiting and len(found) < MAX_ALTERNATIVE_CHOICES:
        request = waiting.pop(0)
        try:
            found.append((request, choose_topics(reader.topics, request, encodings=encodings)))
        except AmbiguousTopicError as error:
            waiting[:0] = [error.settled(request, name) for name in error.names]
    return found


def missing_topics(reader: BagReader, error: TopicError) -> list[DoctorFinding]:
    """Why no topics could be chosen."""
    findings = [DoctorFinding(str(error), "record what is missing, or name the topic", blocks=True)]
    has_calibration = any(topic.type in CAMERA_INFO_TYPES for topic in reader.topics)
    if not has_calibration and "camera-info" not in str(error):
        text = "found no calibration (sensor_msgs/CameraInfo)"
        findings.append(DoctorFinding(text, "record the camera_info topic beside the images", blocks=True))
    return findings
