# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What several tests need: worlds, recordings, messages, nodes and their peers. pytest finds it by ``pythonpath``."""
