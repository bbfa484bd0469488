#!/usr/bin/env python3
"""What we do beside what others' libraries do, on the same machine and the same meshes, in one run.

deformation_transfer: every frame by deformation transfer as published, scripted with SciPy, beside all of ours from
decomposition to written frames. nricp_amberg, nricp_sumner: trimesh's registrations beside ours, from
performers with so many vertices onto the target as it is, with the same 30 landmarks (ours also knows the performer's
own rims of lips and lids, from 4,326 vertices on; trimesh takes no lines).
filter_taubin: trimesh's filter, frame by frame. nnls: scipy.optimize.nnls, frame by frame (right from SciPy 1.16 on).

Accuracy is how far each is off, less is better; "NOT AHEAD" marks what is not faster at equal or better accuracy. A
registration that is not done after --limit seconds is stopped; its time is then at least that.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import scipy

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from benchmarks._peers.comparison import HEAD, Comparison  # noqa: E402
from benchmarks._peers.frames import compare_smoothing, compare_transfer, compare_weights  # noqa: E402
from benchmarks._peers.registration import PEERS, compare_registration  # noqa: E402
from data import ensure_samples  # noqa: E402
from toolkit.errors import InputError  # noqa: E402

_FRAMES = ("deformation_transfer", "filter_taubin", "nnls")


def main() -> int:
    """Run the comparisons, print the table."""
    options = _parser().parse_args()
    if "nnls" in options.only and tuple(map(int, scipy.__version__.split(".")[:2])) < (1, 16):
        print(f"note: scipy.optimize.nnls of SciPy {scipy.__version__} is not always right; it is from 1.16 on")
    print(HEAD, flush=True)
    rows = []
    try:
        for row in _rows(options):
            print(row.line(), flush=True)
            rows.append(row)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    if options.json:
        print(json.dumps({"rows": [row.data() for row in rows]}))
        print(json.dumps({"ratios": {row.name: row.ratio for row in rows}}))
    return 0


def _rows(options: argparse.Namespace) -> Iterator[Comparison]:
    samples = ensure_samples(level=options.level, targets=(options.target,))
    if "deformation_transfer" in options.only:
        with tempfile.TemporaryDirectory(prefix="mien_peers_", dir=options.work) as folder:
            small = ensure_samples(level=0, targets=(options.target,))
            compare_transfer(small, options.target, 20, Path(folder) / "warm")  # compiled
            yield compare_transfer(samples, options.target, options.frames, Path(folder) / "run")
    if "filter_taubin" in options.only:
        yield compare_smoothing(samples, min(options.frames, 32))
    if "nnls" in options.only:
        yield compare_weights(samples, min(options.frames, 64), options.bases)
    peers = [name for name in PEERS if name in options.only]
    for n_vertices in options.registration if peers else ():
        yield from compare_registration(options.target, n_vertices, peers, options.limit)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = (*_FRAMES, *PEERS)
    parser.add_argument(
        "--only", nargs="+", choices=names, default=names, metavar="NAME", help=f"of {', '.join(names)}"
    )
    parser.add_argument(
        "--level", type=int, choices=(0, 1, 2), default=1, help="sample for the frames' comparisons (1)"
    )
    parser.add_argument("--frames", type=int, default=90, help="frames; 32 at most for the filter, 64 for nnls (90)")
    parser.add_argument("--bases", type=int, default=10, help="bases for nnls (10)")
    parser.add_argument(
        "--registration",
        type=int,
        nargs="+",
        default=[2_500],
        metavar="V",
        help="vertices, e.g. 2500 12000 30000 (2500)",
    )
    parser.add_argument("--limit", type=float, default=600, help="seconds after which a registration is stopped (600)")
    parser.add_argument("--target", default="asian_female", help="the sample target (asian_female)")
    parser.add_argument("--work", type=Path, help="where to put the temporary shot")
    parser.add_argument("--json", action="store_true", help="end with one line of JSON")
    return parser


if __name__ == "__main__":
    sys.exit(main())
