# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From observations to frames: pair, rectify, and refuse with a reason."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from vigg_ros.registration.errors import DataError
from vigg_ros.registration.frame import Frame
from vigg_ros.registration.options import PairingConfig
from vigg_ros.sensors.header import NS_PER_S
from vigg_ros.sensors.observation import Calibration, ColourImage, DepthImage, Observation, PointCloud
from vigg_ros.tracking.extrinsics import Lookup
from vigg_ros.tracking.pairing import Pair, Pairing, Unpaired


@dataclass(frozen=True, slots=True)
class SyncedFrame:
    """A frame ready for registration."""

    frame: Frame
    frame_id: str
    """The coordinate frame of the results: the camera's with depth images, the scan's with points."""
    session: int
    """Grows when tracking must start again: the clock jumped back, or the camera changed."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """An input that did not become a frame. Every leading message becomes one or the other."""

    stamp_ns: int
    code: str
    message: str
    session: int
    leads: bool = True
    """Whether it would have been a frame; False for a message of the other topic, whose leader is told apart."""


Assembled = SyncedFrame | Refusal
Leader = ColourImage | PointCloud
Follower = DepthImage | ColourImage
_Outcome = Pair[Leader, Follower] | Unpaired[Leader]


@dataclass(frozen=True, slots=True)
class Match:
    """Two messages of the same moment with the calibration that held then: all that a frame is made of."""

    leader: Leader
    follower: Follower
    calibration: Calibration | None
    session: int

    @property
    def stamp_ns(self) -> int:
        """The stamp of the frame."""
        return self.leader.stamp_ns


class FrameAssembler:
    """Feeds on observations in any order of topics, gives frames in order of their stamps.

    One topic leads: each of its messages becomes a frame or a refusal, at its stamp. With depth images the
    colour image leads; with ``extrinsics``, which say where the points are in the camera's frame, the scan
    does. The latest calibration holds for what follows; frames wait for the first one.
    """

    def __init__(self, config: PairingConfig, extrinsics: Lookup | None = None) -> None:
        self._slop_ns, self._queue_size = round(config.sync_slop_s * NS_PER_S), config.queue_size
        self._pairing: Pairing[Leader, Follower] = Pairing(self._slop_ns, self._queue_size)
        self._waiting: deque[_Outcome] = deque()
        self._extrinsics = extrinsics
        self._calibration: Calibration | None = None
        self._changes = 0
        self._loops_before = 0
        self._session = (0, 0)

    def add(self, observation: Observation) -> list[Assembled]:
        """Frames and refusals that are certain once this observation is known."""
        return [self._assemble(found) for found in self.match(observation)]

    def flush(self) -> list[Assembled]:
        """What is left at the end of a recording."""
        self._waiting.extend(self._pairing.flush())
        return [self._assemble(found) for found in self._release(at_end=True)]

    def match(self, observation: Observation) -> list[Match | Refusal]:
        """As ``add``, but frames are not built yet: that takes time, which is saved for those that are dropped."""
        try:
            if isinstance(observation, Calibration):
                self._calibrate(observation)
            elif self._leads(observation):
                self._waiting.extend(self._pairing.add_first(observation.stamp_ns, observation))  # type: ignore[arg-type]
            elif isinstance(observation, (ColourImage, DepthImage)):
                self._waiting.extend(self._pairing.add_second(observation.stamp_ns, observation))
        except DataError as error:
            return [Refusal(observation.stamp_ns, error.code, str(error), self._number(), self._leads(observation))]
        return self._release()

    def restart(self) -> list[Match | Refusal]:
        """Forget all stamps, as before a recording; the calibration holds on. What waited is returned, unbuilt."""
        self._waiting.extend(self._pairing.flush())
        waiting = self._release(at_end=True)
        self._pairing = Pairing(self._slop_ns, self._queue_size)
        self._loops_before = self._session[0]
        return waiting

    def build(self, match: Match) -> Assembled:
        """The frame of a match, or why there is none. May run in another thread than ``match``."""
        try:
            frame = self._build(match)
        except DataError as error:
            return Refusal(match.stamp_ns, error.code, str(error), match.session)
        return SyncedFrame(frame, match.leader.frame_id, match.session)

    @property
    def session(self) -> int:
        """The session of what was released last."""
        return self._number()

    def _leads(self, observation: Observation) -> bool:
        return isinstance(observation, ColourImage if self._extrinsics is None else PointCloud)

    def _calibrate(self, calibration: Calibration) -> None:
        old = self._calibration
        self._calibration = calibration
        if old is not None and not old.same_camera(calibration):
            self._changes += 1

    def _release(self, *, at_end: bool = False) -> list[Match | Refusal]:
        released: list[Match | Refusal] = []
        while self._waiting:
            ready = self._calibration is not None or at_end or len(self._waiting) > self._queue_size
            if not ready and isinstance(self._waiting[0], Pair):
                break
            released.append(self._settle(self._waiting.popleft()))
        return released

    def _settle(self, outcome: _Outcome) -> Match | Refusal:
        self._session = max(self._session, (self._loops_before + outcome.loop, self._changes))
        if isinstance(outcome, Unpaired):
            message = f"no {self._partner()} has a stamp within sync_slop_s, nearer to this one than to its neighbours"
            return Refusal(outcome.first.stamp_ns, "UNPAIRED", message, self._number())
        return Match(outcome.first, outcome.second, self._calibration, self._number())

    def _assemble(self, found: Match | Refusal) -> Assembled:
        return self.build(found) if isinstance(found, Match) else found

    def _build(self, match: Match) -> Frame:
        leader, follower = match.leader, match.follower
        if match.calibration is None:
            raise DataError(
                "NO_CALIBRATION",
                found="images without a CameraInfo",
                expected="a CameraInfo message of the colour camera",
                remedy="publish it, or name its topic",
            )
        if isinstance(leader, PointCloud):
            assert isinstance(follower, ColourImage), "scans are paired with images"
            return scan_frame(leader, follower, match.calibration, self._extrinsics)
        assert isinstance(follower, DepthImage), "images are paired with depth"
        return depth_frame(leader, follower, match.calibration)

    def _partner(self) -> str:
        return "depth image" if self._extrinsics is None else "colour image"

    def _number(self) -> int:
        return sum(self._session)


def depth_frame(colour: ColourImage, depth: DepthImage, calibration: Calibration) -> Frame:
    """The rectified frame of a colour and an aligned depth image, at the image's stamp. Raises DataError."""
    if depth.depth_m.shape != colour.image.shape[:2]:
        raise DataError(
            "DEPTH_SIZE",
            found=f"depth of shape {depth.depth_m.shape} with an image of shape {colour.image.shape[:2]}",
            expected="equal sizes",
            remedy="use depth that is registered to the colour image",
        )
    calibration = calibration.fitted_to(colour.image.shape)
    image, depth_m = colour.image, depth.depth_m
    if calibration.rectifier is not None:
        image, depth_m = calibration.rectifier.image(image), calibration.rectifier.depth(depth_m)
    return Frame.from_depth(image, depth_m, calibration.camera, stamp_ns=colour.stamp_ns)


def scan_frame(scan: PointCloud, colour: ColourImage, calibration: Calibration, extrinsics: Lookup | None) -> Frame:
    """The frame of a scan and a rectified image, at the scan's stamp, in the scan's frame. Raises DataError."""
    camera_frame = colour.frame_id or calibration.frame_id
    T_camera_points = None if extrinsics is None else extrinsics(camera_frame, scan.frame_id)
    if T_camera_points is None:
        raise DataError(
            "NO_TF",
            found=f"no transform from {scan.frame_id!r} to {camera_frame!r}",
            expected="a chain of static transforms between scanner and camera",
            remedy="publish it on /tf_static, or give the extrinsics as a parameter",
        )
    calibration = calibration.fitted_to(colour.image.shape)
    image = colour.image if calibration.rectifier is None else calibration.rectifier.image(colour.image)
    return Frame.from_points(
        image, scan.points, calibration.camera, T_camera_points, stamp_ns=scan.stamp_ns, times_s=scan.times_s
    )
