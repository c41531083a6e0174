# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the kernels are compiled: once, kept on disk where there is a place for it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba


def compiled(function: Callable[..., Any] | None = None, *, fastmath: bool = False) -> Any:
    """Compile a function at its first call, with the interpreter lock released while it runs.

    The result is cached next to the source or in the user's cache folder. Where neither can be written (a
    read-only system, a service without a home) it is compiled at every start; NUMBA_CACHE_DIR names
    another place.
    """
    if function is None:
        return lambda decorated: compiled(decorated, fastmath=fastmath)
    try:
        return numba.njit(function, cache=True, nogil=True, fastmath=fastmath)
    except RuntimeError:  # numba's "no locator available": there is no place for a cache
        return numba.njit(function, nogil=True, fastmath=fastmath)
