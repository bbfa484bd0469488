#!/usr/bin/env python3
"""Step 2: take out the head's motion; split every frame into large-scale shape and fine detail."""

from __future__ import annotations

import sys

from _stage import stage_script

if __name__ == "__main__":
    sys.exit(stage_script(__doc__, "decompose"))
