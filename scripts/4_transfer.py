#!/usr/bin/env python3
"""Step 4: transfer the bases to the target."""

from __future__ import annotations

import sys

from _stage import stage_script

if __name__ == "__main__":
    sys.exit(stage_script(__doc__, "transfer"))
