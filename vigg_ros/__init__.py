# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""vigg_ros: registration of camera frames with depth, by visual-geometric mutual guidance (ViGG)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vigg_ros.pipeline import Pipeline

__version__ = "0.1.0"
__all__ = ["Pipeline", "__version__"]


def __getattr__(name: str) -> Any:
    """``vigg_ros.Pipeline``, loaded when it is asked for: ``vigg --help`` and the node start without it."""
    if name == "Pipeline":
        from vigg_ros.pipeline import Pipeline

        return Pipeline
    raise AttributeError(f"module 'vigg_ros' has no attribute {name!r}")
