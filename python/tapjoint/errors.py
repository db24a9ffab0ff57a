"""Exceptions of tapjoint. Every message says what is wrong, what is allowed, and what to do.

``tapjoint.NoAnswerError`` stands beside the result that it holds.
"""

from __future__ import annotations


class TapjointError(Exception):
    """Base of all exceptions of tapjoint.

    Attributes:
        file: The file with the problem, as it was named; None where no file is the cause.
        line: Its line, counted from 1; None where there is none.
        remedy: What to do, the part of the message behind its last semicolon; None where there is none.
    """

    file: str | None
    line: int | None
    remedy: str | None

    def __init__(
        self,
        message: str,
        *,
        file: str | None = None,
        line: int | None = None,
        remedy: str | None = None,
    ) -> None:
        super().__init__(message)
        self.file = file
        self.line = line
        # Results that were written in spite of the error follow the remedy.
        _, mark, part = message.partition("; written all the same: ")[0].rpartition("; ")
        self.remedy = remedy or (part if mark else None)


class InputError(TapjointError, ValueError):
    """Arguments or data that cannot be used."""


class RecordingError(InputError):
    """A recording that cannot be read, or that lacks the channel asked for."""


class DescriptionError(InputError):
    """A test description that is not valid, or that does not fit its recordings."""


class BatchError(TapjointError):
    """Tasks of a batch on a cluster failed in all their attempts. What was finished is kept."""


class MissingPackageError(TapjointError, ImportError):
    """A package that this call needs is not installed. The message has the command that installs it."""


class TapjointWarning(UserWarning):
    """A doubt that the program prints on standard error."""
