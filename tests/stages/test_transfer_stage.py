from __future__ import annotations

from pathlib import Path

import numpy as np

from toolkit.mesh import TriangleMesh
from toolkit.meshio import write_mesh
from toolkit.shot import Shot
from toolkit.stages import run_stages
from toolkit.stages.transfer import open_system
from toolkit.transfer import DeformationTransfer


def test_edits_get_the_matrix_that_the_bases_were_solved_with(
    bump: TriangleMesh, take: np.ndarray, tmp_path: Path
) -> None:
    write_mesh(tmp_path / "source.ply", bump)
    target = bump.with_vertices(bump.vertices * [1.2, 0.9, 1.1])
    write_mesh(tmp_path / "target.ply", target)
    np.save(tmp_path / "take.npy", take.astype(np.float32))
    (tmp_path / "shot.toml").write_text(
        '[source]\nreference="source.ply"\nframes="take.npy"\nfps=30\n[target]\nreference="target.ply"\n'
        "[stabilise]\nenabled=false\n[bases]\ncount=3\n"
    )
    shot = Shot(tmp_path)
    run_stages(shot, ["transfer"])
    smooth, deltas = shot.array("decompose", "rest_smooth"), np.array(shot.array("decompose", "smooth_deltas"))
    moves = deltas[np.array(shot.array("bases", "frames"))]
    rest, bases = np.array(shot.array("transfer", "rest")), np.array(shot.array("transfer", "bases"))
    made = DeformationTransfer(smooth, rest, bump.triangles, moves)
    system = open_system(shot)
    assert abs(system.matrix - made.matrix).max() < 1e-12 * abs(made.matrix).max()
    right = system.matrix @ (bases[1] - rest)
    assert np.abs(system.factor.solve(right) - (bases[1] - rest)).max() < 1e-9
    assert np.abs(made.solve()[1] - bases[1]).max() < 1e-9
