"""What a check says, and how it becomes a log line or an error."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from toolkit.errors import InputError

__all__ = ["Finding", "Repairs", "Severity", "log_findings", "raise_for"]

logger = logging.getLogger(__name__)

Severity = Literal["error", "warning", "info"]
Repairs = Literal["drop faces", "drop vertices", "split edges", "orient", "turn over", "weld"]

_LEVELS = {"error": logging.ERROR, "warning": logging.WARNING, "info": logging.INFO}


@dataclass(frozen=True)
class Finding:
    """One thing noticed about the input.

    ``severity``: an "error" stops the work, a "warning" may spoil the result or is repaired, an "info" is only said.
    ``what``, ``where`` and ``remedy`` make one sentence (`InputError`); ``index`` the vertex, face, frame or landmark
    it is about, if it is about one; ``repair`` what `repair_source` or `repair_target` can do about it.
    """

    severity: Severity
    what: str
    where: str = ""
    index: int | None = None
    remedy: str = ""
    repair: Repairs | None = None

    @property
    def sentence(self) -> str:
        """What, where and the remedy, in one sentence."""
        return str(self.as_error())

    def as_error(self) -> InputError:
        """Return the error that says this."""
        return InputError(self.what, where=self.where, remedy=self.remedy)


def raise_for(findings: Iterable[Finding]) -> None:
    """Raise `InputError` for the first error, and mention how many more there are; do nothing without errors."""
    errors = [finding for finding in findings if finding.severity == "error"]
    if not errors:
        return
    first = errors[0]
    more = f" ({len(errors) - 1} more of the input's faults are in the log)" if len(errors) > 1 else ""
    for finding in errors[1:]:
        logger.error("%s", finding.sentence)
    raise InputError(first.what + more, where=first.where, remedy=first.remedy)


def log_findings(findings: Iterable[Finding]) -> None:
    """Say warnings and information in the log, one line each; errors are left to `raise_for`."""
    for finding in findings:
        if finding.severity != "error":
            logger.log(_LEVELS[finding.severity], "%s", finding.sentence)


def and_more(count: int) -> str:
    """Return ", and 7 more" where 8 were found and one was named."""
    return f", and {count - 1} more" if count > 1 else ""
