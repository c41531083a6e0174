#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How many images of a TUM folder get a depth image, how far apart their stamps are, and how long an image waits.

usage: python tools/pairing_wait.py FOLDER
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from vigg_ros.bench.datasets.tum_folder import open_tum
from vigg_ros.registration.config import Config
from vigg_ros.tracking.pairing import Pairing


def main() -> None:
    """Feed the stamps in their order, as if messages took no time, and print what the pairs show."""
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    dataset, config = open_tum(Path(sys.argv[1])), Config.preset("rgbd").pairing
    pairing: Pairing[int, int] = Pairing(config)
    arrivals = sorted([(file.stamp_ns, 0) for file in dataset.images] + [(file.stamp_ns, 1) for file in dataset.depths])
    apart_ms, waited_ms = [], []
    for now_ns, side in arrivals:
        add = pairing.add_second if side else pairing.add_first
        for pair in add(now_ns, now_ns):
            if pair.second is not None:
                apart_ms.append(abs(pair.second - pair.first) / 1e6)
                waited_ms.append((now_ns - pair.first) / 1e6)
    apart_ms += [abs(pair.second - pair.first) / 1e6 for pair in pairing.flush() if pair.second is not None]
    print(f"{len(apart_ms)} of {len(dataset.images)} images have depth (slop {config.sync_slop_s:g} s)")
    for name, values in (("apart", apart_ms), ("an image waits", waited_ms)):
        print(f"{name}: median {np.median(values):.1f} ms, max {np.max(values):.1f} ms")


if __name__ == "__main__":
    main()
