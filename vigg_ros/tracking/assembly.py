# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From observations to frames: pair, rectify, and refuse with a reason."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

from vigg_ros.registration.errors import DataError
from vigg_ros.registration.frame import Frame
from vigg_ros.registration.options import PairingConfig
from vigg_ros.sensors.header import NS_PER_S
from vigg_ros.sensors.observation import Calibration, ColourImage, DepthImage, Observation, PointCloud
from vigg_ros.tracking.extrinsics import Lookup
from vigg_ros.tracking.pairing import Pairing, SyncedPair
from vigg_ros.tracking.user_mask import UserMask


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


@dataclass(frozen=True, slots=True)
class SyncedMessages:
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

    def __init__(
        self, config: PairingConfig, extrinsics: Lookup | None = None, mask: UserMask | None = None
    ) -> None:
        self._config = config
        self._mask = mask
        self._pairing: Pairing[Leader, Follower] = Pairing(config)
        self._waiting: deque[SyncedPair[Leader, Follower]] = deque()
        self._extrinsics = extrinsics
        self._calibration: Calibration | None = None
        self._camera_changes = 0
        self._loop_offset = 0
        self._session = (0, 0)

    def remaining(self) -> list[SyncedMessages | Refusal]:
        """What is left at the end of a recording."""
        self._waiting.extend(self._pairing.flush())
        return self._release(at_end=True)

    def synchronize(self, observation: Observation) -> list[SyncedMessages | Refusal]:
        """What is certain once this observation is known. No frame is built yet: those that are dropped need not be."""
        try:
            if isinstance(observation, Calibration):
                self._calibrate(observation)
            elif self._leads(observation):
                self._waiting.extend(self._pairing.add_first(observation.stamp_ns, observation))  # type: ignore[arg-type]
            elif isinstance(observation, (ColourImage, DepthImage)):
                self._waiting.extend(self._pairing.add_second(observation.stamp_ns, observation))
        except DataError as error:
            return [Refusal(observation.stamp_ns, error.code, str(error), self.session, self._leads(observation))]
        return self._release()

    def restart(self) -> list[SyncedMessages | Refusal]:
        """Forget all stamps, as before a recording; the calibration holds on. What waited is returned."""
        waiting = self.remaining()
        self._pairing = Pairing(self._config)
        self._loop_offset = self._session[0]
        return waiting

    def build(self, messages: SyncedMessages) -> Assembled:
        """The frame of two messages, or why there is none. May run in another thread than ``synchronize``."""
        try:
            frame = self._build(messages)
            frame = frame if self._mask is None else self._mask.apply(frame)
        except DataError as error:
            return Refusal(messages.stamp_ns, error.code, str(error), messages.session)
        return SyncedFrame(frame, messages.leader.frame_id, messages.session)

    @property
    def session(self) -> int:
        """The session of what was released last."""
        return sum(self._session)

    def _leads(self, observation: Observation) -> bool:
        return isinstance(observation, ColourImage if self._extrinsics is None else PointCloud)

    def _calibrate(self, calibration: Calibration) -> None:
        old = self._calibration
        self._calibration = calibration
        if old is not None and not old.same_camera(calibration):
            self._camera_changes += 1

    def _release(self, *, at_end: bool = False) -> list[SyncedMessages | Refusal]:
        released: list[SyncedMessages | Refusal] = []
        while self._waiting:
            ready = self._calibration is not None or at_end or len(self._waiting) > self._config.queue_size
            if not ready and self._waiting[0].second is not None:
                break
            released.append(self._release_pair(self._waiting.popleft()))
        return released

    def _release_pair(self, pair: SyncedPair[Leader, Follower]) -> SyncedMessages | Refusal:
        self._session = max(self._session, (self._loop_offset + pair.loop, self._camera_changes))
        if pair.second is None:
            partner = "depth image" if self._extrinsics is None else "colour image"
            message = f"no {partner} has a stamp within sync_slop_s, or those that have belong to other frames"
            return Refusal(pair.first.stamp_ns, "UNPAIRED", message, self.session)
        return SyncedMessages(pair.first, pair.second, self._calibration, self.session)

    def _build(self, messages: SyncedMessages) -> Frame:
        leader, follower = messages.leader, messages.follower
        if messages.calibration is None:
            raise DataError(
                "NO_CALIBRATION", found="images without a CameraInfo",
                expected="a CameraInfo message of the colour camera", remedy="publish it, or name its topic",
            )
        apart_s = abs(leader.stamp_ns - follower.stamp_ns) / NS_PER_S
        if isinstance(leader, PointCloud):
            assert isinstance(follower, ColourImage), "scans are paired with images"
            frame = scan_frame(leader, follower, messages.calibration, self._extrinsics)
            return replace(frame, apart_s=apart_s)
        assert isinstance(follower, DepthImage), "images are paired with depth"
        return replace(depth_frame(leader, follower, messages.calibration), apart_s=apart_s)


def depth_frame(colour: ColourImage, depth: DepthImage, calibration: Calibration) -> Frame:
    """The rectified frame of a colour and an aligned depth image, at the image's stamp. Raises DataError."""
    if depth.depth_m.shape != colour.image.shape[:2]:
        raise DataError(
            "DEPTH_SIZE", found=f"depth of shape {depth.depth_m.shape} with an image of shape {colour.image.shape[:2]}",
            expected="equal sizes", remedy="use depth that is registered to the colour image",
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
            "NO_TF", found=f"no transform from {scan.frame_id!r} to {camera_frame!r}",
            expected="a chain of static transforms between scanner and camera",
            remedy="publish it on /tf_static, or give the extrinsics as a parameter",
        )
    calibration = calibration.fitted_to(colour.image.shape)
    image = colour.image if calibration.rectifier is None else calibration.rectifier.image(colour.image)
    return Frame.from_points(
        image, scan.points, calibration.camera, T_camera_points, stamp_ns=scan.stamp_ns, times_s=scan.times_s
    )
