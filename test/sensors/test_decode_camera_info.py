# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""CameraInfo: which matrix describes which images. Calibrations that are none are in test_decode_refusals.py."""

from __future__ import annotations

import numpy as np
import pytest

from vigg_ros.registration.camera import Camera
from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.camera_info import decode_camera_info, images_on
from vigg_ros_testing.message_samples import STAMP_NS, camera_info, header, region

LENS = [-0.3, 0.1, 0.001, -0.002, 0.0]
RAW = Camera(640, 480, 500.0, 510.0, 319.5, 239.5)
RECTIFIED = Camera(640, 480, 400.0, 410.0, 300.0, 200.0)


@pytest.mark.parametrize(
    ("topic", "images"),
    [
        ("/camera/color/image_raw", "raw"),
        ("rgb/image", "raw"),
        ("/camera/image_color", "raw"),
        ("/camera/image_rect", "rectified"),
        ("/camera/image_rect_color", "rectified"),
        ("/camera/depth/image_rect_raw", "rectified"),
        ("/zed/zed_node/rgb/rect/image", "rectified"),
        ("/zed/zed_node/rgb/image_rect_color/compressed", "rectified"),
        ("/left/image_rectified", "rectified"),
        ("/camera/Image_Rect", "rectified"),
        ("/camera/image_unrectified", "raw"),
        ("/direct/image", "raw"),
        ("/rectangle_detector/image", "raw"),
        ("/correct/image_raw", "raw"),
        ("", "raw"),
    ],
)
def test_the_name_of_the_topic_says_whether_its_images_are_rectified(topic, images):
    assert images_on(topic) == images
    assert images_on(topic, "assume_rectified") == "rectified"
    assert images_on(topic, "undistort") == "raw"


ROW_MATRICES = "CameraInfo: rectified: P, otherwise K and D; P[0] zero: K"


@pytest.mark.hostile(ROW_MATRICES)
def test_rectified_images_are_described_by_p_and_need_nothing():
    calibration = decode_camera_info(camera_info(d=LENS), images="rectified")
    assert calibration.camera == RECTIFIED
    assert calibration.rectifier is None
    assert (calibration.stamp_ns, calibration.frame_id, calibration.notes) == (STAMP_NS, "camera", ())


@pytest.mark.hostile(ROW_MATRICES)
def test_distorted_images_are_rectified_from_k_and_d_to_p():
    calibration = decode_camera_info(camera_info(d=LENS), images="raw")
    assert calibration.camera == RECTIFIED
    assert calibration.rectifier is not None
    assert calibration.rectifier.raw == RAW
    assert calibration.rectifier.rectified == RECTIFIED
    assert calibration.rectifier.coefficients == tuple(LENS)


@pytest.mark.hostile(ROW_MATRICES)
@pytest.mark.parametrize("lens", [[], [0.0] * 4, [0.0] * 5])
def test_raw_images_without_distortion_are_described_by_k(lens):
    calibration = decode_camera_info(camera_info(d=lens), images="raw")
    assert calibration.camera == RAW
    assert calibration.rectifier is None


@pytest.mark.hostile(ROW_MATRICES)
def test_without_p_the_rectified_camera_is_that_of_k():
    without = camera_info(d=LENS, p=[0.0] * 12, r=[0.0] * 9)
    assert decode_camera_info(without, images="rectified").camera == RAW
    calibration = decode_camera_info(without, images="raw")
    assert calibration.camera == RAW
    assert calibration.rectifier is not None
    assert calibration.rectifier.rectified == RAW


TURN = [0.8, 0.0, 0.6, 0.0, 1.0, 0.0, -0.6, 0.0, 0.8]


def test_a_rotated_camera_is_rectified_even_without_distortion():
    calibration = decode_camera_info(camera_info(r=TURN), images="raw")
    assert calibration.rectifier is not None
    assert calibration.rectifier.R_rectified_raw == tuple(TURN)


def test_the_matrices_of_ros_1_are_read_too():
    msg = camera_info()
    for name in "dkrp":
        setattr(msg, name.upper(), np.array(getattr(msg, name)))
        delattr(msg, name)
    assert decode_camera_info(msg, images="rectified").camera == RECTIFIED


def test_a_calibration_may_have_no_stamp():
    assert decode_camera_info(camera_info(header=header(0, 0)), images="raw").stamp_ns == 0


MODELS = (
    "CameraInfo: plumb_bob with 0, 4 or 5, rational_polynomial with 8, 12 or 14, equidistant with 4 "
    "coefficients A, others R unless all D are 0"
)


@pytest.mark.hostile(MODELS)
@pytest.mark.parametrize(
    ("model", "count"),
    [
        ("plumb_bob", 4),
        ("plumb_bob", 5),
        ("rational_polynomial", 8),
        ("rational_polynomial", 12),
        ("rational_polynomial", 14),
        ("equidistant", 4),
    ],
)
def test_known_lenses_are_taken(model, count):
    msg = camera_info(distortion_model=model, d=[0.01] * count)
    rectifier = decode_camera_info(msg, images="raw").rectifier
    assert rectifier is not None
    assert (rectifier.model, len(rectifier.coefficients)) == (model, count)
    image = np.full((480, 640, 3), 255, np.uint8)
    assert rectifier.image(image)[240, 320].tolist() == [255, 255, 255]


@pytest.mark.hostile(MODELS)
@pytest.mark.parametrize(
    ("model", "count"),
    [("plumb_bob", 3), ("plumb_bob", 8), ("rational_polynomial", 5), ("equidistant", 5), ("", 5)]
    + [("thin_prism_fisheye", 8), ("q" * 10_000, 4)],
)
def test_unknown_lenses_matter_only_where_they_distort(model, count):
    distorted = camera_info(distortion_model=model, d=[0.01] * count)
    assert decode_camera_info(distorted, images="rectified").camera == RECTIFIED
    undistorted = camera_info(distortion_model=model, d=[0.0] * count)
    assert decode_camera_info(undistorted, images="raw").camera == RAW


SIZES = "CameraInfo: size differs from the image: binning and ROI consistent A, else R"


@pytest.mark.hostile(SIZES)
def test_binning_divides_the_image():
    # The left edge of the image is at -0.5: 320 pixels right of it is the centre; halved, 160 - 0.5.
    msg = camera_info(binning_x=2, binning_y=3)
    calibration = decode_camera_info(msg, images="raw")
    assert calibration.camera == Camera(320, 160, 250.0, 170.0, 159.5, 79.5)
    assert calibration.fitted_to((160, 320, 3)) is calibration


@pytest.mark.hostile(SIZES)
def test_a_region_moves_the_centre_and_binning_follows():
    msg = camera_info(binning_x=2, binning_y=2, roi=region(100, 40, width=401, height=200))
    calibration = decode_camera_info(msg, images="raw")
    assert calibration.camera == Camera(200, 100, 250.0, 255.0, 109.5, 99.5)
    assert calibration.fitted_to((100, 200)) is calibration


@pytest.mark.hostile(SIZES)
def test_a_region_is_not_a_scaled_image():
    calibration = decode_camera_info(camera_info(roi=region(0, 0, width=320, height=240)), images="raw")
    with pytest.raises(DataError) as caught:
        calibration.fitted_to((480, 640))
    assert caught.value.code == "CALIBRATION_SIZE"


@pytest.mark.hostile(SIZES)
def test_region_and_binning_act_on_the_lens_too():
    msg = camera_info(d=LENS, binning_x=2, binning_y=2, roi=region(100, 40, width=400, height=200))
    rectifier = decode_camera_info(msg, images="raw").rectifier
    assert rectifier is not None
    assert rectifier.raw == Camera(200, 100, 250.0, 255.0, 109.5, 99.5)
    assert rectifier.rectified == Camera(200, 100, 200.0, 205.0, 99.75, 79.75)


ASPECT = "Image: image and CameraInfo of different size but equal aspect: scale K, A, else R"


@pytest.mark.hostile(ASPECT)
@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        ((240, 320), Camera(320, 240, 250.0, 255.0, 159.5, 119.5)),
        ((960, 1280, 3), Camera(1280, 960, 1000.0, 1020.0, 639.5, 479.5)),
    ],
)
def test_an_image_of_equal_aspect_scales_the_camera(shape, expected):
    assert decode_camera_info(camera_info(), images="raw").fitted_to(shape).camera == expected


@pytest.mark.hostile(ASPECT)
def test_a_rounded_side_is_still_equal_aspect():
    # 1280x720 divided by three is 426.7x240.
    msg = camera_info(width=1280, height=720)
    camera = decode_camera_info(msg, images="raw").fitted_to((240, 427)).camera
    assert (camera.width_px, camera.height_px) == (427, 240)
    assert camera.fx_px == pytest.approx(500 * 427 / 1280)
    assert camera.fy_px == pytest.approx(510 / 3)


@pytest.mark.hostile(ASPECT)
def test_the_lens_is_scaled_with_the_camera():
    calibration = decode_camera_info(camera_info(d=LENS), images="raw").fitted_to((240, 320))
    assert calibration.rectifier is not None
    assert calibration.rectifier.raw == Camera(320, 240, 250.0, 255.0, 159.5, 119.5)
    assert calibration.rectifier.rectified == calibration.camera
    assert calibration.rectifier.image(np.zeros((240, 320), np.uint8)).shape == (240, 320)


@pytest.mark.hostile(ASPECT)
@pytest.mark.parametrize("shape", [(480, 639), (480, 641), (640, 480), (1, 1), (360, 640), (960, 640)])
def test_an_image_of_another_aspect_is_refused(shape):
    with pytest.raises(DataError) as caught:
        decode_camera_info(camera_info(), images="raw").fitted_to(shape)
    assert caught.value.code == "CALIBRATION_SIZE"
    assert f"{shape[1]}x{shape[0]}" in caught.value.found


def test_the_second_camera_of_a_stereo_pair_is_noted():
    p = camera_info().p
    p[3] = -40.0
    notes = decode_camera_info(camera_info(p=p), images="rectified").notes
    assert [note.code for note in notes] == ["STEREO_OFFSET"]
