# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What stands in the way of a replay, or is odd, each with its remedy: found in samples and stamps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import zip_longest

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bags.ordering import StampEntry, stamp_order
from vigg_ros.bags.topics import TopicChoice
from vigg_ros.registration.errors import DataError
from vigg_ros.registration.frame import Frame
from vigg_ros.registration.geometry import ProjectedScan
from vigg_ros.registration.options import PairingConfig
from vigg_ros.report.bag_messages import Sample, Samples, observations_of
from vigg_ros.sensors.observation import Calibration, ColourImage, DepthImage, PointCloud
from vigg_ros.tracking.assembly import depth_frame, scan_frame
from vigg_ros.tracking.extrinsics import Lookup
from vigg_ros.tracking.pairing import Pairing, SyncedPair

FLAT_IMAGE_DEVIATION = 3.0
"""Standard deviation in grey levels: an image that varies less shows nothing to match."""

MOSTLY_PAIRED_SHARE = 0.8
"""So large a share of the slower topic in pairs means that its stamps are fine."""

SLOP_MARGIN_FACTOR = 1.2
"""A suggested slop is so much larger than the largest offset that should fit."""

_EXTRINSICS_REMEDY = "record /tf_static too, or give --extrinsics: where the camera stands in the frame of the points"


@dataclass(frozen=True, slots=True)
class DoctorFinding:
    """Something a user should know before the replay, or has to mend for it."""

    text: str
    remedy: str
    blocks: bool = False
    """Whether nothing can be replayed because of it."""

    @classmethod
    def of(cls, error: DataError, where: str, *, blocks: bool) -> DoctorFinding:
        """A refused message or frame."""
        return cls(f"{where}: found {error.found}, expected {error.expected}", error.remedy, blocks)


def check_samples(samples: Samples) -> Iterator[DoctorFinding]:
    """Topics without messages, refused messages, and odd ones that were accepted."""
    for sample in samples.values():
        yield from _refusals(sample, needed=sample.role != "ground_truth")
        notes = {note.code: note for one in sample.observations for note in one.notes}
        for note in notes.values():
            yield DoctorFinding(f"{sample.topic.name}: found {note.found}, {note.taken}", note.remedy)
    yield from _check_frame_ids(samples)
    images = [one.image for one in observations_of(samples, "image") if isinstance(one, ColourImage)]
    if images and max(float(np.std(image)) for image in images) < FLAT_IMAGE_DEVIATION:
        yield DoctorFinding("the first images show next to nothing", "check exposure, lens cap and decoder")


def _refusals(sample: Sample, *, needed: bool) -> Iterator[DoctorFinding]:
    name, refusals = sample.topic.name, sample.refusals
    if not (refusals or sample.observations):
        text = f"{name} has no message that can be read" if sample.topic.count else f"{name} has no messages"
        yield DoctorFinding(text, "record it again; was its publisher running?", blocks=needed)
    elif refusals:
        share = f"{name}, {len(refusals)} of the first {len(refusals) + len(sample.observations)} messages"
        yield DoctorFinding.of(refusals[0], share, blocks=needed and not sample.observations)


def _check_frame_ids(samples: Samples) -> Iterator[DoctorFinding]:
    names = {role: sample.observations[0].frame_id for role, sample in samples.items() if sample.observations}
    image = names.get("image", "")
    if names.get("camera_info", image) != image:
        yield DoctorFinding(
            f"the images are in {image!r}, their calibration is in {names['camera_info']!r}",
            "check that --camera-info-topic names the calibration of this camera",
        )
    if names.get("depth", image) != image:
        yield DoctorFinding(
            f"the images are in {image!r}, depth is in {names['depth']!r}",
            "use depth that is registered to the colour image (often called aligned_depth or depth_registered)",
        )


def check_frames(samples: Samples, extrinsics: Lookup | None) -> tuple[list[str], list[DoctorFinding]]:
    """Make frames of the samples, as a replay would: what the first good one shows, or why there is none."""
    findings: list[DoctorFinding] = []
    for frame in _frames(samples, extrinsics):
        if isinstance(frame, Frame):
            return [_describe(frame)], []
        finding = DoctorFinding.of(frame, "no frame can be made of the first messages", blocks=True)
        findings = [replace(finding, remedy=_EXTRINSICS_REMEDY) if frame.code == "NO_TF" else finding]
    return [], findings


def _frames(samples: Samples, extrinsics: Lookup | None) -> Iterator[Frame | DataError]:
    """A frame of each image and depth image or cloud of the samples; their stamps may differ."""
    calibration = next(iter(observations_of(samples, "camera_info")), None)
    images = [one for one in observations_of(samples, "image") if isinstance(one, ColourImage)]
    geometries = [*observations_of(samples, "depth"), *observations_of(samples, "points")]
    if not (isinstance(calibration, Calibration) and images and geometries):
        return
    for image, geometry in zip_longest(images, geometries):
        image, geometry = image or images[-1], geometry or geometries[-1]
        try:
            if isinstance(geometry, DepthImage):
                yield depth_frame(image, geometry, calibration)
            elif isinstance(geometry, PointCloud):
                yield scan_frame(geometry, image, calibration, extrinsics)
        except DataError as error:
            yield error


def _describe(frame: Frame) -> str:
    if isinstance(frame.geometry, ProjectedScan):
        rows, pixels = frame.geometry.visible()
        width, height = np.ptp(pixels, axis=0) / (frame.camera.width_px, frame.camera.height_px)
        return (
            f"{len(rows)} of the first scan's {len(frame.geometry.cloud)} points project into the image, "
            f"over {width:.0%} of its width and {height:.0%} of its height"
        )
    return f"{np.mean(frame.geometry.depth_m > 0):.0%} of the first image's pixels have a point"


@dataclass(frozen=True, slots=True)
class PairingForecast:
    """What the replay's own pairing makes of the stamps."""

    leaders: int
    """Messages of the leading topic: colour images with depth images, scans with points."""
    followers: int
    """Messages of the other topic."""
    paired: int
    refused: int
    """Leaders with a zero, duplicate or late stamp."""
    sessions: int
    """1, and one more for each jump back in time."""
    offsets_ns: NDArray[np.int64]
    """(N,): to each leader's stamp, the nearest one of the other topic minus its own; (0,) without any."""


def forecast_pairing(
    entries: Sequence[StampEntry], leader: str, follower: str, config: PairingConfig
) -> PairingForecast:
    """Feed the stamps of two topics to the pairing, as a replay of the same entries would."""
    pairing: Pairing[int, int] = Pairing(config)
    add = {leader: pairing.add_first, follower: pairing.add_second}
    stamps_ns: dict[str, list[int]] = {leader: [], follower: []}
    pairs: list[SyncedPair[int, int]] = []
    for entry in (entries[index] for index in stamp_order(entries).tolist()):
        if entry.topic in add and entry.stamp_ns:
            stamps_ns[entry.topic].append(entry.stamp_ns)
            with suppress(DataError):  # a duplicate or late stamp
                pairs += add[entry.topic](entry.stamp_ns, entry.stamp_ns)
    pairs += pairing.flush()
    leaders, followers = (sum(entry.topic == topic for entry in entries) for topic in (leader, follower))
    return PairingForecast(
        leaders=leaders,
        followers=followers,
        paired=sum(pair.second is not None for pair in pairs),
        refused=leaders - len(pairs),  # each leader that was taken is in one pair, alone or not
        sessions=1 + max((pair.loop for pair in pairs), default=0),
        offsets_ns=_offsets(*(np.sort(np.array(own, np.int64)) for own in stamps_ns.values())),
    )


def _offsets(leading: NDArray[np.int64], following: NDArray[np.int64]) -> NDArray[np.int64]:
    """To each of the ascending stamps, the nearest of the other ascending ones minus itself."""
    if not (leading.size and following.size):
        return np.empty(0, np.int64)
    after = np.clip(np.searchsorted(following, leading), 0, following.size - 1)
    candidates = np.stack((following[after], following[np.maximum(after - 1, 0)])) - leading
    nearest = np.abs(candidates).argmin(axis=0)
    return np.asarray(candidates[nearest, np.arange(leading.size)], np.int64)


def check_pairing(
    entries: Sequence[StampEntry], choice: TopicChoice, config: PairingConfig
) -> tuple[list[str], list[DoctorFinding]]:
    """How the stamps of the chosen sensors fit, in sentences, and why some will not find each other."""
    leading, following = (choice.image, choice.depth) if choice.points is None else (choice.points, choice.image)
    assert following is not None, "one of depth and points is chosen"
    leader, follower = ("colour image", "depth image") if choice.points is None else ("scan", "colour image")
    chosen = [entry for entry in entries if entry.topic in choice.names]
    forecast = forecast_pairing(chosen, leading.name, following.name, config)
    within = f"within {1e3 * config.sync_slop_s:g} ms"
    fit = [f"{forecast.paired} of {forecast.leaders} {leader}s have a {follower} {within}"]
    if forecast.offsets_ns.size:
        fit.append(
            f"the nearest {follower} is off by {np.median(forecast.offsets_ns) / 1e6:.1f} ms (median), "
            f"{np.abs(forecast.offsets_ns).max() / 1e6:.1f} ms at most"
        )
    if forecast.sessions > 1:
        fit.append(f"the stamps jump back {forecast.sessions - 1} times: {forecast.sessions} sessions")
    return fit, list(_unpaired(forecast, leader, follower, within))


def _unpaired(forecast: PairingForecast, leader: str, follower: str, within: str) -> Iterator[DoctorFinding]:
    """Stamps that will not find each other."""
    lost = forecast.leaders - forecast.refused - forecast.paired
    if forecast.refused:
        yield DoctorFinding(
            f"{forecast.refused} of {forecast.leaders} {leader}s have a zero or duplicate stamp and are refused",
            "let the driver fill header.stamp, and look for a second publisher on the topic",
        )
    if lost and forecast.offsets_ns.size:
        text = f"{lost} of {forecast.leaders} {leader}s find no {follower} {within}"
        yield DoctorFinding(text, _pairing_remedy(forecast), blocks=forecast.paired < 2)
    elif forecast.paired < 2:
        text = f"{forecast.paired} {leader}s have a {follower}: there is no motion to find"
        yield DoctorFinding(text, "record longer", blocks=True)


def _pairing_remedy(forecast: PairingForecast) -> str:
    median_s = float(np.median(forecast.offsets_ns)) / 1e9
    typical_s = float(np.percentile(np.abs(forecast.offsets_ns), 95)) / 1e9
    if abs(median_s) > 1:
        return f"the clocks differ by {median_s:.3f} s: synchronise them and record again"
    if forecast.paired >= MOSTLY_PAIRED_SHARE * forecast.followers:
        return "the others come at a lower rate, and nearly all of them are used: these are left out"
    if forecast.paired < forecast.leaders / 2 and typical_s < 0.5:
        slop_s = np.ceil(1e3 * SLOP_MARGIN_FACTOR * typical_s) / 1e3
        return f"if the sensors see the same moment, add: --set pairing.sync_slop_s={slop_s:g}"
    return "these are left out; the rest is not affected"
