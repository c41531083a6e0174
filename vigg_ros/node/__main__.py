# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``python -m vigg_ros.node``: the executable ``registrar`` where it is not on the PATH."""

import sys

from vigg_ros.node import main

sys.exit(main())
