# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg register``: two frames from image files, and the motion between them."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from dataclasses import fields
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from vigg_ros.cli.bag_input import add_extrinsics_argument, given_extrinsics
from vigg_ros.cli.config_arguments import add_config_arguments, choose_suited
from vigg_ros.cli.console import ExitCode, UsageError, add_examples, output_folder, positive_float, table
from vigg_ros.pictures import BODY_AXES, OPTICAL_AXES, draw_aligned
from vigg_ros.registration import Camera, Config, Frame, Registration, Rejection, extract, register
from vigg_ros.registration.features import Features
from vigg_ros.registration.geometry import ProjectedScan
from vigg_ros.registration.result import Outcome
from vigg_ros.registration.rigid import angle_rad, transform
from vigg_ros.registration.stages import record_stages
from vigg_ros.report.bag_messages import preset_for_points
from vigg_ros.report.gallery import draw_agreement, draw_scan_of
from vigg_ros.tracking.user_mask import UserMask

SCAN_SUFFIXES = (".bin", ".npy")


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of ``vigg register``."""
    for name in ("target", "source"):
        parser.add_argument(f"{name}_image", help=f"colour or grey image of the {name}")
        parser.add_argument(
            f"{name}_depth",
            help="its depth image (16-bit png, or float tiff in metres), or its scan (.npy of N x 3, or KITTI's .bin)",
        )
    parser.add_argument(
        "--intrinsics", type=float, nargs=4, required=True, metavar=("FX", "FY", "CX", "CY"), help="pixels, rectified"
    )
    parser.add_argument(
        "--depth-scale",
        type=positive_float,
        default=1000.0,
        metavar="UNITS",
        help="units per metre (default: %(default)g)",
    )
    add_extrinsics_argument(parser, "needed for scans")
    parser.add_argument(
        "-o", "--output", metavar="DIR", help="a new folder for the pictures (default: vigg_register_TIME)"
    )
    add_config_arguments(parser, default=None)
    add_examples(
        parser,
        "vigg register a.png a_depth.png b.png b_depth.png --intrinsics 585 585 320 240",
        "vigg register a.png a.bin b.png b.bin --intrinsics 707 707 602 183 "
        "--extrinsics 0.27 0 -0.08 -0.5 0.5 -0.5 0.5",
    )


def run(arguments: Namespace) -> ExitCode:
    """Register, print the transform and its evidence, draw the pictures. FAILED where there is no answer."""
    output = output_folder(arguments.output, "vigg_register")
    target = read_frame(Path(arguments.target_image), Path(arguments.target_depth), arguments)
    source = read_frame(Path(arguments.source_image), Path(arguments.source_depth), arguments)
    chosen = choose_suited(arguments, lambda: suited_preset(target), "data")
    config = chosen.config
    target, source = (UserMask(config.input).apply(frame) for frame in (target, source))
    for note in chosen.notes:
        print(f"note: {note}", file=sys.stderr)
    with record_stages() as timings_ms:
        features = extract(target, config), extract(source, config)
        outcome = register(*features, config)
    print(describe(outcome, timings_ms))
    draw(output, (target, source), features, outcome, config)
    return ExitCode.OK if isinstance(outcome, Registration) else ExitCode.FAILED


def suited_preset(frame: Frame) -> str:
    """The preset for depth images and near points, or that for scans that reach far."""
    return preset_for_points(frame.geometry.cloud) if isinstance(frame.geometry, ProjectedScan) else "rgbd"


def read_frame(image_path: Path, depth_path: Path, arguments: Namespace) -> Frame:
    """A frame from an image file and a depth image or scan. Raises UsageError and DataError."""
    for path in (image_path, depth_path):
        if not path.is_file():
            raise UsageError(f"{path} does not exist")
    image = cv2.imread(str(image_path), cv2.IMREAD_COLOR)
    if image is None:
        raise UsageError(f"{image_path} cannot be read as an image")
    fx_px, fy_px, cx_px, cy_px = arguments.intrinsics
    camera = Camera(image.shape[1], image.shape[0], fx_px, fy_px, cx_px, cy_px)
    if depth_path.suffix in SCAN_SUFFIXES:
        if arguments.extrinsics is None:
            raise UsageError(
                "a scan needs --extrinsics X Y Z QX QY QZ QW: where the camera stands in the frame of the points"
            )
        return Frame.from_points(image, read_scan(depth_path), camera, given_extrinsics(arguments.extrinsics))
    return Frame.from_depth(image, read_depth_m(depth_path, arguments.depth_scale), camera)


def read_depth_m(path: Path, scale: float) -> NDArray[np.float32]:
    """Metres (H, W) of a depth image; 0 and 65535 of 16 bits mean none. Raises UsageError."""
    raw = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if raw is None or raw.ndim != 2 or raw.dtype not in (np.uint16, np.float32):
        found = "no image" if raw is None else f"shape {raw.shape}, type {raw.dtype}"
        raise UsageError(f"{path}: found {found}, expected one channel of 16-bit units or float metres")
    if raw.dtype == np.float32:
        return np.asarray(raw)
    return np.where(raw == 65535, 0, raw).astype(np.float32) / np.float32(scale)


def read_scan(path: Path) -> NDArray[np.float32]:
    """Points (N, 3), metres, of a scan file. Raises UsageError."""
    try:
        if path.suffix == ".npy":
            return np.asarray(np.load(path, allow_pickle=False)[:, :3], np.float32)
        return np.fromfile(path, np.float32).reshape(-1, 4)[:, :3]
    except (OSError, EOFError, ValueError, IndexError) as error:
        raise UsageError(f"{path} cannot be read as a scan: {error}") from error


def describe(outcome: Outcome, timings_ms: dict[str, float]) -> str:
    """The outcome for a reader: transform or reason, evidence, time."""
    lines = []
    if isinstance(outcome, Rejection):
        lines.append(f"no answer: {outcome.reason.value}: {outcome.message}")
    else:
        T, deviation = outcome.T_target_source, np.sqrt(np.diag(outcome.covariance))
        lines.append("T_target_source (p_target = T_target_source @ p_source, metres):")
        lines += ["  " + "  ".join(f"{value: .9f}" for value in row) for row in T]
        lines.append(
            f"moved {np.linalg.norm(T[:3, 3]):.4f} m and turned {np.rad2deg(angle_rad(T[:3, :3])):.3f} deg; standard "
            f"deviation at most {deviation[:3].max():.4f} m and {np.rad2deg(deviation[3:].max()):.3f} deg"
        )
    values = ((field.name, getattr(outcome.evidence, field.name)) for field in fields(outcome.evidence))
    evidence = ((name, f"{value:.4g}" if isinstance(value, float) else value) for name, value in values)
    lines += ["", table([("evidence", ""), *evidence]), ""]
    lines.append(table([("stage", "ms"), *((stage, f"{ms:.1f}") for stage, ms in timings_ms.items())]))
    return "\n".join(lines)


def draw(
    output: Path, frames: tuple[Frame, Frame], features: tuple[Features, Features], outcome: Outcome, config: Config
) -> None:
    """Pictures of the matches, the scans and, if there is an answer, the aligned surfaces. Raises UsageError."""
    target, source = features
    images, keypoints = (frames[0].image, frames[1].image), (target.keypoints, source.keypoints)
    pictures = {"matches.png": draw_agreement(images, keypoints, outcome, config)}
    for name, frame in zip(("target", "source"), frames, strict=True):
        scan = draw_scan_of(frame, panel_width_px=frame.camera.width_px)
        if scan is not None:
            pictures[f"{name}_scan.png"] = scan
    if isinstance(outcome, Registration):
        moved = transform(outcome.T_target_source, source.surface.points)
        axes = OPTICAL_AXES if np.allclose(frames[0].geometry.T_camera_points, np.eye(4)) else BODY_AXES
        pictures["aligned.png"] = draw_aligned(target.surface.points, moved, axes=axes)
    try:
        output.mkdir(parents=True)
    except OSError as error:
        raise UsageError(f"{output} cannot be written: {error}; give another --output") from error
    for name, picture in pictures.items():
        if not cv2.imwrite(str(output / name), picture):
            raise UsageError(f"{output / name} cannot be written; free space or give another --output")
        print(f"drew {output / name}")
