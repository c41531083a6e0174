# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a bag holds, and whether it can be replayed: stamps of all messages, content of a few."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from vigg_ros.bags.ordering import StampEntry
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
from vigg_ros.report.findings import DoctorFinding, check_frames, check_pairing, check_samples
from vigg_ros.report.pairing_forecast import PairingForecast, forecast_pairing
from vigg_ros.report.samples import Sample, suggest_preset, take_samples
from vigg_ros.tracking.extrinsics import Lookup

MAX_ALTERNATIVE_CHOICES = 8
"""So many choices of topics are listed for an ambiguous bag."""


@dataclass(frozen=True, slots=True)
class DiagnosisRequest:
    """What the user asked for, and how to get what depends on the choice of topics."""

    requested: TopicRequest
    find_config: Callable[[str], Config]
    """The configuration, by the preset that suits the bag."""
    find_extrinsics: Callable[[TopicChoice], Lookup | None]
    """Where the points are in the camera's frame; None if neither the user nor the bag says."""


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Everything the page says."""

    rhythms: Mapping[str, Rhythm]
    samples: Sequence[Sample]
    fit: Sequence[str]
    """Sentences on how stamps and geometry of the chosen sensors fit together."""
    findings: Sequence[DoctorFinding]
    preset: str
    replays: Sequence[TopicRequest]
    """The topics to ask for; several where several could be meant, none where nothing can be replayed."""

    @property
    def can_replay(self) -> bool:
        """Whether a replay would find frames."""
        return bool(self.replays)


def diagnose(reader: BagReader, request: DiagnosisRequest) -> Diagnosis:
    """Examine an open bag. The losses of the reader are complete afterwards, but for what was not decoded."""
    encodings = reader.encodings()
    try:
        choices = find_choices(reader, request.requested, encodings)
    except TopicError as error:
        entries = reader.stamps()
        return Diagnosis(find_rhythms(entries), (), (), missing_topics(reader, error), "rgbd", ())
    (requested, choice), *others = choices
    samples = take_samples(reader, choice, request.find_config("rgbd").input)
    preset = suggest_preset(samples)
    extrinsics = None if choice.points is None else request.find_extrinsics(choice)
    entries = reader.stamps()  # after the samples, so that the reader's losses are those of a whole reading
    fit, findings = check_frames(samples, extrinsics)
    timing, pairing = _check_stamps(entries, choice, request.find_config(preset))
    findings = [*_ambiguity(requested, others), *check_samples(samples), *findings, *pairing]
    blocked = any(finding.blocks for finding in findings)
    return Diagnosis(
        rhythms=find_rhythms(entries),
        samples=tuple(samples.values()),
        fit=[*fit, *timing],
        findings=findings,
        preset=preset,
        replays=[request for request, _ in choices] if not blocked or others else (),
    )


def find_choices(
    reader: BagReader, requested: TopicRequest, encodings: Mapping[str, str]
) -> list[tuple[TopicRequest, TopicChoice]]:
    """Each way to choose topics, with the request that leads to it; several if they are ambiguous.

    Raises TopicError when a topic is missing.
    """
    waiting = [requested]
    found: list[tuple[TopicRequest, TopicChoice]] = []
    while waiting and len(found) < MAX_ALTERNATIVE_CHOICES:
        request = waiting.pop(0)
        try:
            found.append((request, choose_topics(reader.topics, request, encodings=encodings)))
        except AmbiguousTopicError as error:
            waiting[:0] = [error.settled(request, name) for name in error.names]
    return found


def _ambiguity(requested: TopicRequest, others: Sequence[tuple[TopicRequest, TopicChoice]]) -> list[DoctorFinding]:
    if not others:
        return []
    text = "several topics could be meant; what follows holds for the first of the commands below"
    return [DoctorFinding(text, "choose one of the commands, or name the topics")]


def missing_topics(reader: BagReader, error: TopicError) -> list[DoctorFinding]:
    """Why no topics could be chosen."""
    findings = [DoctorFinding(str(error), "record what is missing, or name the topic", blocks=True)]
    has_calibration = any(topic.type in CAMERA_INFO_TYPES for topic in reader.topics)
    if not has_calibration and "camera-info" not in str(error):
        text = "found no calibration (sensor_msgs/CameraInfo)"
        findings.append(DoctorFinding(text, "record the camera_info topic beside the images", blocks=True))
    return findings


def _check_stamps(
    entries: Sequence[StampEntry], choice: TopicChoice, config: Config
) -> tuple[list[str], list[DoctorFinding]]:
    chosen = [entry for entry in entries if entry.topic in choice.names]
    if choice.points is None:
        assert choice.depth is not None, "one of depth and points is chosen"
        topics, words = (choice.image.name, choice.depth.name), ("colour image", "depth image")
    else:
        topics, words = (choice.points.name, choice.image.name), ("scan", "colour image")
    forecast = forecast_pairing(chosen, *topics, config.pairing)
    return _describe_forecast(forecast, *words, config), check_pairing(forecast, config.pairing, *words)


def _describe_forecast(forecast: PairingForecast, leader: str, follower: str, config: Config) -> list[str]:
    sentences = [
        f"{forecast.paired} of {forecast.leaders} {leader}s have a {follower} within "
        f"{1e3 * config.pairing.sync_slop_s:g} ms"
    ]
    if forecast.offsets_ns.size:
        sentences.append(
            f"the nearest {follower} is off by {forecast.offset_ns / 1e6:.1f} ms (median), "
            f"{forecast.largest_offset_ns / 1e6:.1f} ms at most"
        )
    if forecast.sessions > 1:
        sentences.append(f"the stamps jump back {forecast.sessions - 1} times: {forecast.sessions} sessions")
    return sentences
