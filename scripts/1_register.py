#!/usr/bin/env python3
"""Step 1: find the target's shape on the source's topology, from landmarks and non-rigid ICP."""

from __future__ import annotations

import sys

from _stage import stage_script

if __name__ == "__main__":
    sys.exit(stage_script(__doc__, "register"))
