"""Checking the input before any work, and repairing what can be repaired safely.

Checks return `Finding`s, they raise nothing: `raise_for` turns the first error into an `InputError`, `log_findings`
says the rest. `repair_source` and `repair_target` mend what carries a ``repair``, and say so in the log.
`check_inputs` does all of it, in order, for one transfer.
"""

from toolkit.checks.findings import Finding, Severity, log_findings, raise_for
from toolkit.checks.inputs import CheckedInputs, Places, check_inputs
from toolkit.checks.mesh import check_mesh
from toolkit.checks.picks import check_feature_lines, check_landmarks
from toolkit.checks.repair import Repair, repair_source, repair_target
from toolkit.checks.scale import check_scale
from toolkit.checks.sequence import check_pair, check_sequence

__all__ = [
    "CheckedInputs",
    "Finding",
    "Places",
    "Repair",
    "Severity",
    "check_feature_lines",
    "check_inputs",
    "check_landmarks",
    "check_mesh",
    "check_pair",
    "check_scale",
    "check_sequence",
    "log_findings",
    "raise_for",
    "repair_source",
    "repair_target",
]
