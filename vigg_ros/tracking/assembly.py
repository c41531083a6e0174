# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From observations to frames: pair, rectify, and refuse with a reason."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Union

from vigg_ros.registration.options import PairingConfig
from vigg_ros.registration.errors import DataError
from vigg_ros.registration.frame import Frame
from vigg_ros.tracking.observation import Calibration, ColourImage, DepthImage, Observation
from vigg_ros.tracking.pairing import Pair, Pairing, Unpaired


@dataclass(frozen=True, slots=True)
class SyncedFrame:
    """A frame ready for registration."""

    frame: Frame
    frame_id: str
    """The sensor's coordinate frame, in which results are given."""
    session: int
    """Grows when tracking must start again: the clock jumped back, or the camera changed."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """An input that did not become a frame. Every colour image becomes one or the other."""

    stamp_ns: int
    code: str
    message: str
    session: int


Assembled = Union[SyncedFrame, Refusal]
_Outcome = Union[Pair[ColourImage, DepthImage], Unpaired[ColourImage]]


class FrameAssembler:
    """Feeds on observations in any order of topics, gives frames in order of their stamps.

    The latest calibration holds for what follows; images wait for the first one.
    """

    def __init__(self, config: PairingConfig) -> None:
        self._pairing: Pairing[ColourImage, DepthImage] = Pairing(round(config.sync_slop_s * 1e9), config.queue_size)
        self._waiting: deque[_Outcome] = deque()
        self._queue_size = config.queue_size
        self._calibration: Calibration | None = None
        self._changes = 0
        self._session = (0, 0)

    def add(self, observation: Observation) -> list[Assembled]:
        """Frames and refusals that are certain once this observation is known."""
        try:
            if isinstance(observation, Calibration):
                self._calibrate(observation)
            elif isinstance(observation, ColourImage):
                self._waiting.extend(self._pairing.add_first(observation.stamp_ns, observation))
            elif isinstance(observation, DepthImage):
                self._waiting.extend(self._pairing.add_second(observation.stamp_ns, observation))
        except DataError as error:
            return [Refusal(observation.stamp_ns, error.code, str(error), self._number())]
        return self._release()

    def flush(self) -> list[Assembled]:
        """What is left at the end of a recording."""
        self._waiting.extend(self._pairing.flush())
        return self._release(at_end=True)

    def _calibrate(self, calibration: Calibration) -> None:
        old = self._calibration
        self._calibration = calibration
        if old is not None and (old.camera, old.rectifier) != (calibration.camera, calibration.rectifier):
            self._changes += 1

    def _release(self, *, at_end: bool = False) -> list[Assembled]:
        assembled: list[Assembled] = []
        while self._waiting:
            ready = self._calibration is not None or at_end or len(self._waiting) > self._queue_size
            if not ready and isinstance(self._waiting[0], Pair):
                break
            assembled.append(self._assemble(self._waiting.popleft()))
        return assembled

    def _assemble(self, outcome: _Outcome) -> Assembled:
        self._session = max(self._session, (outcome.loop, self._changes))
        colour = outcome.first
        if isinstance(outcome, Unpaired):
            message = "no depth image has a stamp within sync_slop_s of this image, and no nearer image of its own"
            return Refusal(colour.stamp_ns, "UNPAIRED", message, self._number())
        try:
            frame = build_frame(colour, outcome.second, self._calibration)
        except DataError as error:
            return Refusal(colour.stamp_ns, error.code, str(error), self._number())
        return SyncedFrame(frame, colour.frame_id, self._number())

    def _number(self) -> int:
        return sum(self._session)


def build_frame(colour: ColourImage, depth: DepthImage, calibration: Calibration | None) -> Frame:
    """The rectified frame of a colour and an aligned depth image, at the image's stamp. Raises DataError."""
    if calibration is None:
        raise DataError(
            "NO_CALIBRATION",
            found="images without a CameraInfo",
            expected="a CameraInfo message of the colour camera",
            remedy="publish it, or name its topic",
        )
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
