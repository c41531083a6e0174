# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""CameraInfo: which matrix describes which images. Calibrations that are none are in test_message_refusals.py."""

import numpy as np
import pytest

from vigg_ros.registration.camera import Camera
from vigg_ros.registration.errors import DataError
from vigg_ros.registration.options import InputConfig
from vigg_ros.sensors.camera_info import images_on
from vigg_ros.sensors.input_decoder import InputDecoder
from vigg_ros.sensors.rectification import IDENTITY_ROTATION, Rectifier
from vigg_ros_testing.decoder_samples import raw_camera, rectified_camera
from vigg_ros_testing.message_samples import STAMP_NS, camera_info, header, region

LENS = (-0.3, 0.1, 0.001, -0.002, 0.0)
TURN = (0.8, 0.0, 0.6, 0.0, 1.0, 0.0, -0.6, 0.0, 0.8)
RAW = Camera(640, 480, 500.0, 510.0, 319.5, 239.5)
RECTIFIED = Camera(640, 480, 400.0, 410.0, 300.0, 200.0)


@pytest.mark.parametrize(
    ("images", "topics"),
    [
        ("raw", ["", "rgb/image", "/camera/color/image_raw", "/camera/image_color", "/camera/image_unrectified"]),
        ("raw", ["/direct/image", "/rectangle_detector/image", "/correct/image_raw"]),
        ("rectified", ["/camera/image_rect", "/camera/image_rect_color", "/camera/depth/image_rect_raw"]),
        ("rectified", ["/zed/zed_node/rgb/rect/image", "/zed/zed_node/rgb/image_rect_color/compressed"]),
        ("rectified", ["/left/image_rectified", "/camera/Image_Rect"]),
    ],
)
def test_the_name_of_the_topic_says_whether_its_images_are_rectified(images, topics):
    for topic in topics:
        assert images_on(topic) == images
        assert images_on(topic, "assume_rectified") == "rectified"
        assert images_on(topic, "undistort") == "raw"


@pytest.mark.hostile("CameraInfo: rectified: P, otherwise K and D; P[0] zero: K")
@pytest.mark.parametrize(
    ("images", "changes", "camera", "rectifier"),
    [
        (rectified_camera, {"d": LENS}, RECTIFIED, None),
        (raw_camera, {"d": LENS}, RECTIFIED, Rectifier(RAW, RECTIFIED, "plumb_bob", LENS)),
        *((raw_camera, {"d": [0.0] * count}, RAW, None) for count in (0, 4, 5)),
        (rectified_camera, {"d": LENS, "p": [0.0] * 12, "r": [0.0] * 9}, RAW, None),
        (raw_camera, {"d": LENS, "p": [0.0] * 12, "r": [0.0] * 9}, RAW, Rectifier(RAW, RAW, "plumb_bob", LENS)),
        # A rig that is rotated is rectified even without distortion; any model will do.
        (raw_camera, {"r": TURN}, RECTIFIED, Rectifier(RAW, RECTIFIED, "plumb_bob", (0.0,) * 4, TURN)),
        (raw_camera, {"r": IDENTITY_ROTATION}, RAW, None),
    ],
)
def test_which_matrix_describes_which_images(images, changes, camera, rectifier):
    calibration = images(camera_info(**changes))
    assert (calibration.camera, calibration.rectifier) == (camera, rectifier)
    assert (calibration.stamp_ns, calibration.frame_id, calibration.notes) == (STAMP_NS, "camera", ())


def test_the_matrices_of_ros_1_are_read_too():
    msg = camera_info()
    for name in "dkrp":
        setattr(msg, name.upper(), np.array(getattr(msg, name)))
        delattr(msg, name)
    assert rectified_camera(msg).camera == RECTIFIED
    assert raw_camera(camera_info(header=header(0, 0))).stamp_ns == 0, "it may have no stamp"


MODELS = (
    "CameraInfo: plumb_bob with 0, 4 or 5, rational_polynomial with 8, 12 or 14, equidistant with 4 "
    "coefficients A, others R unless all D are 0"
)


@pytest.mark.hostile(MODELS)
@pytest.mark.parametrize(
    ("model", "counts"), [("plumb_bob", (4, 5)), ("rational_polynomial", (8, 12, 14)), ("equidistant", (4,))]
)
def test_known_lenses_are_taken(model, counts):
    for count in counts:
        rectifier = raw_camera(camera_info(distortion_model=model, d=[0.01] * count)).rectifier
        assert rectifier is not None
        assert (rectifier.model, len(rectifier.coefficients)) == (model, count)
        image = np.full((480, 640, 3), 255, np.uint8)
        assert rectifier.image(image)[240, 320].tolist() == [255, 255, 255]


@pytest.mark.hostile(MODELS)
@pytest.mark.parametrize(("model", "count"), [("plumb_bob", 3), ("", 5), ("thin_prism_fisheye", 8), ("q" * 10_000, 4)])
def test_unknown_lenses_matter_only_where_they_distort(model, count):
    assert rectified_camera(camera_info(distortion_model=model, d=[0.01] * count)).camera == RECTIFIED
    assert raw_camera(camera_info(distortion_model=model, d=[0.0] * count)).camera == RAW


SIZES = pytest.mark.hostile("CameraInfo: size differs from the image: binning and ROI consistent A, else R")


@SIZES
@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        # The left edge of the image is at -0.5: 320 pixels right of it is the centre; halved, 160 - 0.5.
        ({"binning_x": 2, "binning_y": 3}, Camera(320, 160, 250.0, 170.0, 159.5, 79.5)),
        # A region moves the centre, and binning follows.
        (
            {"binning_x": 2, "binning_y": 2, "roi": region(100, 40, width=401, height=200)},
            Camera(200, 100, 250.0, 255.0, 109.5, 99.5),
        ),
    ],
)
def test_binning_and_region_of_interest_give_another_camera(changes, expected):
    calibration = raw_camera(camera_info(**changes))
    assert calibration.camera == expected
    assert calibration.fitted_to((expected.height_px, expected.width_px, 3)) is calibration


@SIZES
def test_region_and_binning_act_on_the_lens_too():
    msg = camera_info(d=LENS, binning_x=2, binning_y=2, roi=region(100, 40, width=400, height=200))
    rectifier = raw_camera(msg).rectifier
    assert rectifier is not None
    assert rectifier.raw == Camera(200, 100, 250.0, 255.0, 109.5, 99.5)
    assert rectifier.rectified == Camera(200, 100, 200.0, 205.0, 99.75, 79.75)


ASPECT = pytest.mark.hostile("Image: image and CameraInfo of different size but equal aspect: scale K, A, else R")


@ASPECT
@pytest.mark.parametrize(
    ("size", "shape", "expected"),
    [
        ((640, 480), (240, 320), Camera(320, 240, 250.0, 255.0, 159.5, 119.5)),
        ((640, 480), (960, 1280, 3), Camera(1280, 960, 1000.0, 1020.0, 639.5, 479.5)),
        # 1280x720 divided by three is 426.7x240: a rounded side is still equal aspect.
        ((1280, 720), (240, 427), Camera(427, 240, 500 * 427 / 1280, 510 / 3, 320 * 427 / 1280 - 0.5, 240 / 3 - 0.5)),
    ],
)
def test_an_image_of_equal_aspect_scales_the_camera(size, shape, expected):
    camera = raw_camera(camera_info(width=size[0], height=size[1])).fitted_to(shape).camera
    assert (camera.width_px, camera.height_px) == (expected.width_px, expected.height_px)
    np.testing.assert_allclose(camera.matrix, expected.matrix, rtol=1e-12)
    # And its lens with it.
    distorted = raw_camera(camera_info(width=size[0], height=size[1], d=LENS)).fitted_to(shape)
    np.testing.assert_allclose(distorted.rectifier.raw.matrix, expected.matrix, rtol=1e-12)
    assert distorted.rectifier.rectified == distorted.camera
    assert distorted.rectifier.image(np.zeros(shape, np.uint8)).shape == shape


@ASPECT
@SIZES
@pytest.mark.parametrize(
    ("shape", "changes"),
    [
        *((shape, {}) for shape in [(480, 639), (480, 641), (640, 480), (1, 1), (360, 640), (960, 640)]),
        ((480, 640), {"roi": region(0, 0, width=320, height=240)}),  # a region is not a scaled image
    ],
)
def test_an_image_of_another_aspect_is_refused(shape, changes):
    with pytest.raises(DataError) as caught:
        raw_camera(camera_info(**changes)).fitted_to(shape)
    assert caught.value.code == "CALIBRATION_SIZE"
    assert f"{shape[1]}x{shape[0]}" in caught.value.found


@pytest.mark.hostile("CameraInfo: changes mid-run: drop keyframes, N")
def test_another_camera_than_before_is_noted_once_for_each_change() -> None:
    decoder = InputDecoder(InputConfig(), "/camera/image_raw")
    lenses = [[0.0] * 5, [0.0] * 5, LENS, LENS, [0.0] * 5]
    codes = [[note.code for note in decoder.decode("camera_info", camera_info(d=lens)).notes] for lens in lenses]
    assert codes == [[], [], ["CALIBRATION_CHANGED"], [], ["CALIBRATION_CHANGED"]]
