#!/usr/bin/env python3
"""Step 5: carry the details over and write result/frames.npy."""

from __future__ import annotations

import sys

from _stage import stage_script

if __name__ == "__main__":
    sys.exit(stage_script(__doc__, "result"))
