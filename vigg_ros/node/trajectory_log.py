# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The poses so far, in little memory, and the file they are saved into."""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vigg_ros.messages.tum_lines import tum_lines
from vigg_ros.registration.errors import ViggError

CAPACITY = 500_000
"""Poses kept, the newest ones: 55 MB, over four hours at 30 Hz."""

_BLOCK = 10_000
"""Poses that are turned into lines at a time: all at once would take several times their memory."""


class SaveError(ViggError):
    """A trajectory that cannot be saved."""


class TrajectoryLog:
    """The newest poses of the current session: stamps and the upper three rows of T_odom_frame."""

    def __init__(self, capacity: int = CAPACITY) -> None:
        self._capacity = capacity
        self._session = 0
        self._stamps_ns = array("q")
        self._rows = array("d")
        self.forgotten = 0
        """Poses of this session that were given up for newer ones."""

    def __len__(self) -> int:
        return len(self._stamps_ns)

    def add(self, stamp_ns: int, session: int, T_odom_frame: NDArray[np.float64]) -> None:
        """A pose; one of another session begins anew."""
        if session != self._session:
            self._session, self.forgotten = session, 0
            del self._stamps_ns[:], self._rows[:]
        if len(self._stamps_ns) >= self._capacity:  # in large steps: removing from the front moves the rest
            count = max(1, self._capacity // 10)
            del self._stamps_ns[:count], self._rows[: 12 * count]
            self.forgotten += count
        self._stamps_ns.append(stamp_ns)
        self._rows.extend(T_odom_frame[:3].ravel().tolist())

    def copy(self) -> TrajectoryLog:
        """The poses of now, to be saved while others are added here: that takes seconds, and copying none."""
        other = TrajectoryLog(self._capacity)
        other._session, other.forgotten = self._session, self.forgotten
        other._stamps_ns, other._rows = self._stamps_ns[:], self._rows[:]
        return other

    def lines(self) -> Iterator[str]:
        """The poses as lines of a TUM file."""
        yield f"# session {self._session}" + (f", without its first {self.forgotten} poses" if self.forgotten else "")
        for begin in range(0, len(self), _BLOCK):
            end = begin + _BLOCK
            rows = np.array(self._rows[12 * begin : 12 * end]).reshape(-1, 3, 4)
            yield from tum_lines(np.array(self._stamps_ns[begin:end]), rows)

    def save(self, folder: str) -> Path:
        """Write a new file into an existing folder and say where. Raises SaveError; never overwrites."""
        if not folder:
            raise SaveError("output_dir is empty; start the node with the parameter output_dir, an existing folder")
        if not self._stamps_ns:
            raise SaveError("there is no pose yet, so nothing was written")
        name = f"trajectory_{datetime.now():%Y%m%d_%H%M%S_%f}_session{self._session}.tum"
        path = Path(folder).expanduser().resolve() / name
        try:
            _write_whole(path, self.lines())
        except OSError as error:
            raise SaveError(f"{path} cannot be written: {error.strerror}; check output_dir") from error
        return path


def _write_whole(path: Path, lines: Iterator[str]) -> None:
    """Write a new file that has its name only when it is complete: the process may be killed while it writes."""
    partial = path.with_name(f".{path.name}.part")
    with partial.open("x", encoding="utf-8") as file:
        try:
            file.writelines(f"{line}\n" for line in lines)
            file.flush()
            path.touch(exist_ok=False)  # claims the name; a hard link would too, but not on every file system
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)
