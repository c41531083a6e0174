# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What can go wrong, by border: configuration, one message, one bag.

Failing to *register* is not among them: that is a value, see ``result.Rejection``.
"""

from __future__ import annotations


class ViggError(Exception):
    """Base of the errors this package raises on purpose; their text is fit for a user."""


class ConfigError(ViggError):
    """A configuration that cannot be used: unknown key, wrong type, out of bounds."""


class DataError(ViggError):
    """One message or frame that cannot be used; the process goes on with the next one.

    ``code`` is a short upper-case name under which rejected inputs are counted.
    """

    def __init__(self, code: str, *, found: str, expected: str, remedy: str) -> None:
        super().__init__(f"found {found}, expected {expected}; {remedy}")
        self.code = code
        self.found = found
        self.expected = expected
        self.remedy = remedy


class BagError(ViggError):
    """A bag or data set folder that cannot be read or written."""
