"""The steps from a shot's files to its result: each reads what the steps before left, calls the toolkit, and stores.

`run_stages` runs them in order and skips what is up to date. A stage knows the stage before it only by its arrays.
"""

from toolkit.stages.run import STAGES, StageReport, current_key, run_stages, stage_parameters

__all__ = ["STAGES", "StageReport", "current_key", "run_stages", "stage_parameters"]
