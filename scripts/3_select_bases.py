#!/usr/bin/env python3
"""Step 3: choose a few frames as bases, with non-negative weights for every frame."""

from __future__ import annotations

import sys

from _stage import stage_script

if __name__ == "__main__":
    sys.exit(stage_script(__doc__, "bases"))
