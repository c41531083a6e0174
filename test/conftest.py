# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Settings of all tests: the profiles of hypothesis. `make fuzz` chooses the second one."""

from hypothesis import settings

# No deadline: a timing is never asserted in a test. Derandomized: a red run is red again.
settings.register_profile("house", deadline=None, derandomize=True, max_examples=50)
settings.register_profile("fuzz", deadline=None, max_examples=1000, print_blob=True)
settings.load_profile("house")
