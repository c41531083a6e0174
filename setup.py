# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Installs the package, for pip and for colcon (ament_python). The version is the one in package.xml."""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

HERE = Path(__file__).parent
NAME = "vigg_ros"
TEST = ["pytest>=7.4", "pytest-xdist>=3.5", "hypothesis>=6.98"]
DOCS = ["mkdocs-material>=9.5", "mkdocstrings[python]>=0.26"]
LINT = ["ruff>=0.9", "mypy>=1.14", "types-PyYAML"]
ROS = ["ros-jazzy-rclpy[fastrtps]", "ros-jazzy-common-interfaces"]
# The wheels of rclpy are for x86-64 alone; elsewhere the tests of the node are skipped, unless ROS is sourced.
ROS_WHEELS = [f"{name}; platform_machine == 'x86_64' and sys_platform == 'linux'" for name in ROS]
OPEN3D = ["open3d>=0.18"]  # also the reference that our FPFH is tested against
EVO = ["evo>=1.28"]  # the reference that our errors of trajectories are tested against, and nothing else
EVALUATION = [*OPEN3D, "small_gicp>=1.0", "kiss-matcher>=1.0; platform_machine == 'x86_64'"]


def shared_files():
    """The pairs (folder below the prefix, files) that ROS 2 looks up under share/."""
    by_folder = {}
    for pattern in ("config/*", "launch/*.py", "bags/*.md", "bags/*/*"):
        for path in sorted(HERE.glob(pattern)):
            if path.is_file() and path.parent.name != "__pycache__":
                relative = path.relative_to(HERE)
                by_folder.setdefault(f"share/{NAME}/{relative.parent}", []).append(str(relative))
    return [
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        *by_folder.items(),
    ]


setup(
    name=NAME,
    version=ElementTree.parse(HERE / "package.xml").findtext("version"),
    description="Registration of camera frames with depth (ViGG) for ROS 2 and recorded bags",
    long_description=(HERE / "README.md").read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    license="Apache-2.0",
    author="The vigg_ros authors",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={NAME: ["py.typed", "**/*.html", "**/*.css"]},
    data_files=shared_files(),
    zip_safe=False,
    python_requires=">=3.10",
    install_requires=[
        "numpy>=1.26",
        "scipy>=1.11",
        "opencv-python-headless>=4.6",
        "numba>=0.58",
        "rosbags>=0.11.9",
        "lz4>=4.0",
        "pyyaml>=6.0",
        "matplotlib>=3.6",
    ],
    extras_require={
        "ros": ROS,
        "evaluation": EVALUATION,
        "test": TEST,
        "docs": DOCS,
        "dev": [*TEST, *DOCS, *ROS_WHEELS, *EVALUATION, *EVO, *LINT, "pytest-cov>=5"],
    },
    entry_points={"console_scripts": ["vigg = vigg_ros.cli.main:main", "registrar = vigg_ros.node:main"]},
)
