# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which topics of a bag to use: found by type, told apart by encoding and name, asked for if unclear."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Literal

from vigg_ros.bags.reader import IMAGE_TYPES, Topic
from vigg_ros.registration.errors import BagError

CAMERA_INFO_TYPES = ("sensor_msgs/msg/CameraInfo",)
POINTS_TYPES = ("sensor_msgs/msg/PointCloud2",)
GROUND_TRUTH_TYPES = ("geometry_msgs/msg/PoseStamped", "nav_msgs/msg/Odometry")
TF_TYPES = ("tf2_msgs/msg/TFMessage",)

_DEPTH_ENCODING = re.compile(r"16UC1|32FC1|64FC1|16SC1|compressedDepth", re.IGNORECASE)
_TRANSPORT_NAME = re.compile(r"/(compressed|compressedDepth|zstd|theora)$")
_ALIGNED_NAME = re.compile(r"aligned|registered", re.IGNORECASE)
_NOT_COLOUR_NAME = re.compile(r"infra|/ir\d*/|thermal|mask|label|segment|confidence", re.IGNORECASE)
_TRUTH_NAME = re.compile(r"truth|(^|[/_])gt([/_]|$)|vicon|mocap|optitrack|vrpn", re.IGNORECASE)


class TopicError(BagError):
    """The topics to use are missing or not clear: the user has to say which (a usage error)."""


class AmbiguousTopicError(TopicError):
    """Several topics could be meant; ``option`` is the field of TopicRequest that decides, ``names`` are its values."""

    def __init__(self, option: str, names: Sequence[str], meant: str) -> None:
        flag = f"--{option.replace('_', '-')}-topic"
        super().__init__(f"several topics could be {meant}: {', '.join(names)}; choose one with {flag}")
        self.option = option
        self.names = tuple(names)

    def settled(self, requested: TopicRequest, name: str) -> TopicRequest:
        """The request with this one of the names chosen."""
        settled: dict[str, Any] = {self.option: name}
        return replace(requested, **settled)


@dataclass(frozen=True, slots=True)
class TopicRequest:
    """Topics given by name; None where one is to be found."""

    image: str | None = None
    camera_info: str | None = None
    depth: str | None = None
    points: str | None = None
    ground_truth: str | None = None
    geometry: Literal["depth", "points"] | None = None
    """Where the 3-D points come from; None: depth images if there are any, else clouds."""


@dataclass(frozen=True, slots=True)
class TopicChoice:
    """The topics of one camera with depth; exactly one of depth and points is set."""

    image: Topic
    camera_info: Topic
    depth: Topic | None
    points: Topic | None
    ground_truth: Topic | None
    tf_static: Topic | None
    notes: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The chosen topics' names, for ``BagReader.messages``."""
        chosen = (self.image, self.camera_info, self.depth, self.points, self.ground_truth, self.tf_static)
        return tuple(topic.name for topic in chosen if topic is not None)


def choose_topics(
    topics: Sequence[Topic], requested: TopicRequest = TopicRequest(), *, encodings: Mapping[str, str] | None = None
) -> TopicChoice:
    """The topics to use, of those a bag holds (``BagReader.topics``, ``BagReader.encodings()``).

    Prefers topics that belong to one camera, depth that is aligned to the colour image, and raw images
    to compressed ones. Raises TopicError, listing the candidates and the option to give, when a topic
    is missing, has the wrong type, or several could be meant.
    """
    images = [topic for topic in topics if topic.type in IMAGE_TYPES]
    depths = [topic for topic in images if _is_depth(topic, encodings or {})]
    candidates = _find_candidates(topics, depths, requested)
    chosen = _best_combination(candidates, frozenset(map(_namespace, depths)))
    image, _, geometry = chosen.values()
    if image.name == geometry.name:
        raise TopicError(f"{image.name} cannot be both --image-topic and --{list(chosen)[2]}-topic")
    truth, notes = _find_truth(topics, requested.ground_truth)
    transforms = [topic for topic in topics if topic.type in TF_TYPES and topic.name.endswith("tf_static")]
    return TopicChoice(
        image=image,
        camera_info=chosen["camera_info"],
        depth=chosen.get("depth"),
        points=chosen.get("points"),
        ground_truth=truth,
        tf_static=transforms[0] if transforms else None,
        notes=notes,
    )


def _find_candidates(
    topics: Sequence[Topic], depths: Sequence[Topic], requested: TopicRequest
) -> dict[str, list[Topic]]:
    """What could be meant by each option: image, camera_info, and depth or points."""
    by_depth = requested.geometry == "depth" or (
        requested.geometry is None and not requested.points and bool(depths or requested.depth)
    )
    if not (by_depth or requested.geometry or any(topic.type in POINTS_TYPES for topic in topics)):
        raise TopicError(
            "found neither depth images (--depth-topic) nor clouds (--points-topic); "
            + _listing(topics, (*IMAGE_TYPES, *POINTS_TYPES))
        )
    if by_depth:
        geometry = {"depth": _narrow(topics, depths, requested.depth, "depth", IMAGE_TYPES)}
    else:
        geometry = {"points": _narrow(topics, topics, requested.points, "points", POINTS_TYPES)}
    colours = [topic for topic in topics if topic not in depths]
    return {
        "image": _narrow(topics, colours, requested.image, "image", IMAGE_TYPES),
        "camera_info": _narrow(topics, topics, requested.camera_info, "camera-info", CAMERA_INFO_TYPES),
        **geometry,
    }


def _narrow(
    topics: Sequence[Topic], likely: Sequence[Topic], name: str | None, option: str, types: tuple[str, ...]
) -> list[Topic]:
    """The topic of that name, or without a name the likely topics of these types; never none."""
    if name is not None:
        named = [topic for topic in topics if topic.name.lstrip("/") == name.lstrip("/")]
        found = [topic for topic in named if topic.type in types]
        if not found:
            held = f"is of type {named[0].type}" if named else "is not in the bag"
            raise TopicError(f"--{option}-topic {name} {held}; {_listing(topics, types)}")
        return found
    found = [topic for topic in likely if topic.type in types]
    if not found:
        raise TopicError(f"found no topic for --{option}-topic; {_listing(topics, types)}")
    return [topic for topic in found if topic.count] or found


def _best_combination(candidates: dict[str, list[Topic]], depth_namespaces: frozenset[str]) -> dict[str, Topic]:
    """Of each option the topic that belongs to the others best; raises AmbiguousTopicError for a tie."""
    combinations = list(product(*candidates.values()))
    scores = [_score(image, info, geometry, depth_namespaces) for image, info, geometry in combinations]
    highest = max(scores)
    best = [one for one, score in zip(combinations, scores, strict=True) if score == highest]
    for option, members in zip(candidates, zip(*best, strict=True), strict=True):
        names = sorted({topic.name for topic in members})
        if len(names) > 1:
            raise AmbiguousTopicError(option, names, "meant")
    return dict(zip(candidates, best[0], strict=True))


def _score(image: Topic, info: Topic, geometry: Topic, depth_namespaces: frozenset[str]) -> tuple[float, ...]:
    """How well three topics belong together; compared from left to right, larger is better."""
    return (
        not _NOT_COLOUR_NAME.search(image.name),
        _info_rank(image, info, depth_namespaces),
        geometry.type in POINTS_TYPES or _root(image) == _root(geometry),
        bool(_ALIGNED_NAME.search(geometry.name)),
        _namespace(image) == _namespace(geometry),
        image.type == IMAGE_TYPES[0],
        geometry.type != IMAGE_TYPES[1],
        _processing_rank(image.name),
        _processing_rank(geometry.name),
    )


def _info_rank(image: Topic, info: Topic, depth_namespaces: frozenset[str]) -> int:
    """Calibrations are published beside their images; that of a depth camera is the last resort."""
    namespace = _namespace(info)
    if namespace == _namespace(image):
        return 3
    if namespace not in depth_namespaces and _root(info) == _root(image):
        return 2
    return 1 if namespace not in depth_namespaces or _ALIGNED_NAME.search(namespace) else 0


def _processing_rank(name: str) -> int:
    """Of images of the same camera, colour before grey and rectified before raw."""
    last = _TRANSPORT_NAME.sub("", name).rpartition("/")[2]
    return 2 * ("mono" not in last) + ("rect" in last)


def _find_truth(topics: Sequence[Topic], name: str | None) -> tuple[Topic | None, tuple[str, ...]]:
    """The ground truth, if any: as named, else the one topic that is called so, else the only pose topic."""
    if name is not None:
        return _narrow(topics, topics, name, "ground-truth", GROUND_TRUTH_TYPES)[0], ()
    poses = [topic for topic in topics if topic.type in GROUND_TRUTH_TYPES and topic.count]
    called = [topic for topic in poses if _TRUTH_NAME.search(topic.name)]
    if len(called) > 1:
        raise AmbiguousTopicError("ground_truth", [topic.name for topic in called], "the truth")
    if called:
        return called[0], ()
    names = ", ".join(topic.name for topic in poses)
    if len(poses) == 1:
        return poses[0], (f"{names} is taken for the ground truth, as the only topic with poses",)
    note = f"no topic is named as ground truth; to compare, give --ground-truth-topic, one of: {names}"
    return None, (note,) if poses else ()


def _is_depth(topic: Topic, encodings: Mapping[str, str]) -> bool:
    encoding = encodings.get(topic.name, "")
    unclear = encoding.lower() in ("", "mono16", "png")
    return "depth" in topic.name.lower() if unclear else bool(_DEPTH_ENCODING.search(encoding))


def _namespace(topic: Topic) -> str:
    """/camera/color of /camera/color/image_raw/compressed."""
    return _TRANSPORT_NAME.sub("", topic.name).rpartition("/")[0]


def _root(topic: Topic) -> str:
    """/camera of /camera/color/image_raw."""
    return _namespace(topic).rpartition("/")[0]


def _listing(topics: Iterable[Topic], types: tuple[str, ...]) -> str:
    kind = " or ".join(types)
    held = [f"{topic.name} ({topic.count})" for topic in topics if topic.type in types]
    if held:
        return f"the bag's topics of type {kind}: {', '.join(held)}"
    others = ", ".join(f"{topic.name} ({topic.type})" for topic in topics)
    return f"the bag has no topic of type {kind}, only: {others or 'nothing'}"
