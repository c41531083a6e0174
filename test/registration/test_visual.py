# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Visual matches by hand-made descriptors, and detectors on drawn images."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from vigg_ros.registration import Camera, Frame
from vigg_ros.registration.options import VisualConfig
from vigg_ros.registration.visual import DETECTORS, Keypoints, detect, detect_sift, match_visual

CAMERA = Camera(width_px=160, height_px=120, fx_px=140.0, fy_px=140.0, cx_px=79.5, cy_px=59.5)


def keypoints(descriptors: NDArray[np.generic], first: int = 0) -> Keypoints:
    """Keypoints whose points say which they are: (n, n, n) from n = first on."""
    n = first + np.arange(len(descriptors))
    points = np.column_stack((n, n, n)).astype(float)
    return Keypoints(points[:, :2].astype(np.float32), points, descriptors, len(n), np.zeros(len(n)))


def directions(*angles_deg: float) -> NDArray[np.float32]:
    angles = np.deg2rad(angles_deg)
    return np.column_stack((np.cos(angles), np.sin(angles))).astype(np.float32)


def squared(angle_deg: float) -> float:
    """Squared distance of unit vectors at an angle: (2 sin(a / 2))^2."""
    return float((2 * np.sin(np.deg2rad(angle_deg) / 2)) ** 2)


def test_the_nearest_is_matched_if_it_is_clearly_nearer() -> None:
    """Source descriptors at 11, 58 and 35 deg; target ones at 0, 30 and 90 deg."""
    target, source = keypoints(directions(0, 30, 90)), keypoints(directions(11, 58, 35), first=10)
    # 11: 11 and 19 deg away, squares 1 : 2.96. 58: 28 and 32, 1 : 1.3. 35: 5 and 35.
    found = match_visual(target, source, VisualConfig(ratio=0.8))
    assert found.target[:, 0].tolist() == [1, 0, 1], "the most similar first"
    assert found.source[:, 0].tolist() == [12, 10, 11]
    assert found.target_row.tolist() == [1, 0, 1]
    assert found.source_row.tolist() == [2, 0, 1]
    np.testing.assert_allclose(found.similarity, [1 - squared(a) / 2 for a in (5, 11, 28)], atol=1e-6)
    ratios = [squared(a) / squared(b) for a, b in ((5, 35), (11, 19), (28, 32))]
    for ratio, count in ((ratios[2] + 0.01, 3), (ratios[2] - 0.01, 2), (ratios[1] - 0.01, 1)):
        assert len(match_visual(target, source, VisualConfig(ratio=ratio))) == count
    target, source = keypoints(directions(0, 60, 120)), keypoints(directions(9, 62, 124, 5, 3), first=10)
    assert match_visual(target, source, VisualConfig(top_k=3)).source[:, 0].tolist() == [11, 14, 12], "the best top_k"


@pytest.mark.parametrize(
    ("target", "source"),
    [((), (0, 20)), ((0,), (0, 20)), ((0, 20), ()), ((), ()), ((10, 10, 80), (10, 11))],
    ids=["no target", "one target", "no source", "neither", "the same descriptor twice"],
)
def test_what_cannot_be_told_apart_has_no_matches(target: tuple[float, ...], source: tuple[float, ...]) -> None:
    found = match_visual(keypoints(directions(*target)), keypoints(directions(*source)), VisualConfig(ratio=1.0))
    assert (len(found), found.target.shape) == (0, (0, 3))


def test_bit_strings_are_compared_by_their_differing_bits() -> None:
    """Of 32 bits, the source differs from the targets in 2, 8 and 32: cosines 1 - 2 h / 32."""
    zero = np.zeros((1, 4), np.uint8)
    target = np.array([(0, 0, 0, 0b11), (0xFF, 0, 0, 0), (0xFF,) * 4], np.uint8)
    found = match_visual(keypoints(target), keypoints(zero), VisualConfig(ratio=0.26))
    assert found.target_row.tolist() == [0]
    np.testing.assert_allclose(found.similarity, [1 - 2 * 2 / 32], atol=1e-6)
    # Squared distances go as the counts: 2 / 8 is the ratio.
    assert len(match_visual(keypoints(target), keypoints(zero), VisualConfig(ratio=0.24))) == 0


def blobs(seed: int = 0) -> NDArray[np.uint8]:
    rng = np.random.default_rng(seed)
    image = np.full((120, 160, 3), 128, np.uint8)
    for _ in range(60):
        x, y = rng.uniform((0, 0), (160, 120)).astype(int).tolist()
        cv2.circle(image, (x, y), int(rng.integers(2, 9)), rng.integers(0, 255, 3).tolist(), -1)
    return image


def at_1_m(image: NDArray[np.uint8]) -> Frame:
    return Frame.from_depth(image, np.ones((120, 160), np.float32), CAMERA)


@pytest.mark.parametrize("name", DETECTORS)
def test_a_keypoint_sees_the_point_of_its_pixel(name: str) -> None:
    """On a slope z = 1 + u / 100 each keypoint has the depth of its own column, and the left third has none."""
    column = np.arange(160)
    depth_m = np.tile(np.where(column < 50, 0, 1 + column / 100).astype(np.float32), (120, 1))
    found = detect(Frame.from_depth(blobs(), depth_m, CAMERA), VisualConfig(detector=name, max_keypoints=200))
    assert 20 < len(found) < found.detected <= 220, "OpenCV keeps keypoints that are as strong as the last one"
    u, v = found.pixels.T.astype(float)
    assert u.min() >= 49.5
    z = 1 + np.rint(u) / 100
    expected = np.column_stack(((u - 79.5) / 140 * z, (v - 59.5) / 140 * z, z))
    np.testing.assert_allclose(found.points, expected, atol=1e-5)


@pytest.mark.parametrize("name", DETECTORS)
def test_grey_and_colour_images_give_the_same_keypoints(name: str) -> None:
    grey = cv2.cvtColor(blobs(), cv2.COLOR_BGR2GRAY)
    images = grey, cv2.merge((grey, grey, grey))
    flat, coloured = (detect(at_1_m(image), VisualConfig(detector=name)) for image in images)
    np.testing.assert_array_equal(flat.pixels, coloured.pixels)
    np.testing.assert_array_equal(flat.descriptors, coloured.descriptors)
    if name == "sift":
        np.testing.assert_allclose(np.linalg.norm(flat.descriptors, axis=1), 1, atol=1e-5)
    layout = {"sift": (128, np.float32), "orb": (32, np.uint8)}[name]
    assert (flat.descriptors.shape[1], flat.descriptors.dtype) == layout


@pytest.mark.parametrize("name", DETECTORS)
@pytest.mark.parametrize("shape", [(1, 1), (1, 300), (8, 8), (31, 31)], ids=str)
def test_tiny_images_have_few_keypoints_and_no_accident(name: str, shape: tuple[int, int]) -> None:
    noise = np.random.default_rng(0).integers(0, 256, shape).astype(np.uint8)
    pixels, descriptors = DETECTORS[name](noise, 100)
    assert len(pixels) == len(descriptors)
    assert pixels.shape[1] == 2


@pytest.mark.parametrize("name", DETECTORS)
def test_an_image_turned_by_a_half_matches_itself(name: str) -> None:
    """What is at (u, v) in one is at (159 - u, 119 - v) in the other."""
    config = VisualConfig(detector=name)
    image = blobs(3)
    target, source = (detect(at_1_m(one), config) for one in (image, np.ascontiguousarray(image[::-1, ::-1])))
    found = match_visual(target, source, config)
    assert len(found) > 20
    off_px = target.pixels[found.target_row] + source.pixels[found.source_row] - (159, 119)
    assert np.mean(np.abs(off_px).max(axis=1) < 2) > 0.8


def test_sift_finds_a_blob_where_it_is() -> None:
    """Blobs of known centres, between the pixels; OpenCV's own answer is a quarter of a pixel off."""
    off = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        centre, sigma = rng.uniform(40, 60, 2), rng.uniform(1.5, 6.0)
        y, x = np.mgrid[:100, :100]
        blob = 60 + 150 * np.exp(-((x - centre[0]) ** 2 + (y - centre[1]) ** 2) / (2 * sigma**2))
        pixels, _ = detect_sift(blob.astype(np.uint8), 50)
        distance = np.linalg.norm(pixels - centre, axis=1)
        if len(distance) and distance.min() < 2:
            off.append(pixels[distance.argmin()] - centre)
    assert len(off) > 25
    np.testing.assert_allclose(np.median(off, axis=0), 0, atol=0.01)
