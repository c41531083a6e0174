# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The subcommands of ``vigg``, one module each; ``cli.main`` finds them by name."""
