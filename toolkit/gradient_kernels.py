"""Compiled loops for the transfer of deformation gradients (Sumner and Popovic 2004).

``E = [e0 e1 n]`` are a triangle's edges from its first corner and ``n = e0 x e1 / sqrt(|e0 x e1|)``. Moves of shapes
are ``(V, 3, K)``, the shapes innermost, so that the compiler vectorises over them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from toolkit.compiled import ARITHMETIC, LOOPS, helper, njit

__all__ = ["add_pulls", "add_side_products", "invert_edge_frames", "put_shapes_innermost", "triangle_edges"]

Array = NDArray[np.float64]


@njit(**LOOPS)
def put_shapes_innermost(moves, out, squared):
    """``out`` (V, 3, K) of ``moves`` (K, V, 3), and ``squared`` (V,) of the largest of each vertex."""
    for v in range(len(out)):
        largest = 0.0
        for k in range(len(moves)):
            x, y, z = np.float64(moves[k, v, 0]), np.float64(moves[k, v, 1]), np.float64(moves[k, v, 2])
            out[v, 0, k], out[v, 1, k], out[v, 2, k] = x, y, z
            largest = max(largest, x * x + y * y + z * z)
        squared[v] = largest


@njit(**LOOPS)
def invert_edge_frames(vertices, triangles, inverse, squared):
    """``inverse`` (F, 3, 3) of ``E``, and ``squared`` (F,) of ``|e0 x e1|``; a zero there makes the inverse nonsense.

    Its first two rows are also the gradients, on the triangle, of what is 1 at the second or the third corner.
    """
    for f in range(len(triangles)):
        e, g, x, y, z = triangle_edges(vertices, triangles, f)
        square = x * x + y * y + z * z
        _put_row(inverse[f, 0], g[1] * z - g[2] * y, g[2] * x - g[0] * z, g[0] * y - g[1] * x, square)
        _put_row(inverse[f, 1], y * e[2] - z * e[1], z * e[0] - x * e[2], x * e[1] - y * e[0], square)
        _put_row(inverse[f, 2], x, y, z, np.sqrt(square * np.sqrt(square)))
        squared[f] = square


@helper(forceinline=True, **LOOPS)
def _put_row(row, x, y, z, scale):
    row[0], row[1], row[2] = x / scale, y / scale, z / scale


@helper(forceinline=True, **LOOPS)
def triangle_edges(vertices, triangles, f):
    """``e0``, ``e1`` and the three numbers of ``e0 x e1``; for compiled code."""
    a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
    e = (vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1], vertices[b, 2] - vertices[a, 2])
    g = (vertices[c, 0] - vertices[a, 0], vertices[c, 1] - vertices[a, 1], vertices[c, 2] - vertices[a, 2])
    return e, g, e[1] * g[2] - e[2] * g[1], e[2] * g[0] - e[0] * g[2], e[0] * g[1] - e[1] * g[0]


def add_pulls(
    rest: Array,
    inverse: Array,
    moves: Array,
    triangles: NDArray[np.integer],
    gradients: Array,
    robust: bool,
    weights: Array,
    out: Array,
) -> None:
    """``out[i] += w_f (J_f - I) g_i`` for every corner i of every triangle, ``out`` (V, 3, K).

    ``J`` is the deformation gradient. ``weights`` (F,) are set: 1, or where ``robust`` ``1 / (1 + q_f^2)``, ``q_f`` the
    largest ``|J_f - I|`` of the shapes, Frobenius norm. ``gradients`` (F, 3, 3): its first two rows are ``g`` of the
    second and the third corner; all three sum to zero.
    """
    n_shapes = moves.shape[2]
    frame, share = np.empty((3, 3, n_shapes)), np.empty((2, 3))
    # Where x, y and z are treated alike, one loop over all of them takes less than three short ones.
    columns, moved, pulled = (x.reshape(len(x), 3 * n_shapes) for x in (frame, moves, out))
    scratch = frame, columns, np.empty(n_shapes), share
    _add_pulls(rest, inverse, moved, triangles, gradients, robust, weights, scratch, pulled)


@njit(**LOOPS)
def _add_pulls(rest, inverse, moved, triangles, gradients, robust, weights, scratch, pulled):
    frame, columns, squared, share = scratch
    for f in range(len(triangles)):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        _edge_changes(moved[a], moved[b], moved[c], columns[0], columns[1])
        _normal_changes(*triangle_edges(rest, triangles, f), frame[0], frame[1], frame[2])
        largest = 0.0
        if robust:
            _squared_changes(frame, inverse[f], squared)
            for k in range(len(squared)):
                largest = max(largest, squared[k])
        weights[f] = 1 / (1 + largest)
        for corner in range(2):
            for m in range(3):
                share[corner, m] = weights[f] * (
                    inverse[f, m, 0] * gradients[f, corner, 0]
                    + inverse[f, m, 1] * gradients[f, corner, 1]
                    + inverse[f, m, 2] * gradients[f, corner, 2]
                )
        _pull(columns, share, pulled[a], pulled[b], pulled[c])


@njit(**LOOPS)
def add_side_products(gradients, weights, triangles, starts, ends, out):
    """``out[i, j] += w_f g_i . g_j`` for the sides of every triangle, ``gradients`` as for `add_pulls`.

    ``out`` are the numbers of a sparse matrix with these ``ends`` from ``starts[i]`` on in its row i, ``i < j``.
    """
    for f in range(len(triangles)):
        g, h, w = gradients[f, 0], gradients[f, 1], weights[f]
        gg = w * (g[0] * g[0] + g[1] * g[1] + g[2] * g[2])
        gh = w * (g[0] * h[0] + g[1] * h[1] + g[2] * h[2])
        hh = w * (h[0] * h[0] + h[1] * h[1] + h[2] * h[2])
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        _add_to_side(a, b, -gg - gh, starts, ends, out)
        _add_to_side(b, c, gh, starts, ends, out)
        _add_to_side(c, a, -gh - hh, starts, ends, out)


@helper(forceinline=True, **LOOPS)
def _add_to_side(i, j, product, starts, ends, out):
    e = starts[min(i, j)]
    while ends[e] != max(i, j):
        e += 1
    out[e] += product


@helper(**ARITHMETIC)
def _edge_changes(at_a, at_b, at_c, first, second):
    """How ``e0`` and ``e1`` change, from the moves of a triangle's corners."""
    for i in range(len(first)):
        first[i], second[i] = at_b[i] - at_a[i], at_c[i] - at_a[i]


@helper(**ARITHMETIC)
def _normal_changes(e, g, x, y, z, first, second, out):
    """How ``n`` changes in every shape, ``out`` (3, K), for what `triangle_edges` gives and how the edges change."""
    scale = 1 / np.sqrt(np.sqrt(max(x * x + y * y + z * z, 1e-300)))
    nx, ny, nz = x * scale, y * scale, z * scale
    for k in range(out.shape[1]):
        u, v, w = first[0, k] + e[0], first[1, k] + e[1], first[2, k] + e[2]
        p, q, r = second[0, k] + g[0], second[1, k] + g[1], second[2, k] + g[2]
        x, y, z = v * r - w * q, w * p - u * r, u * q - v * p
        scale = 1 / np.sqrt(np.sqrt(max(x * x + y * y + z * z, 1e-300)))
        out[0, k], out[1, k], out[2, k] = x * scale - nx, y * scale - ny, z * scale - nz


@helper(**ARITHMETIC)
def _squared_changes(frame, inverse, out):
    """``|J - I|^2`` of every shape, ``out`` (K,); ``frame`` (3, 3, K) is how ``E`` changes, its columns first."""
    for k in range(len(out)):
        total = 0.0
        for i in range(3):
            for j in range(3):
                entry = frame[0, i, k] * inverse[0, j] + frame[1, i, k] * inverse[1, j] + frame[2, i, k] * inverse[2, j]
                total += entry * entry
        out[k] = total


@helper(**ARITHMETIC)
def _pull(columns, share, at_a, at_b, at_c):
    """Add what a triangle's frame, its columns (3, 3 K), does to its corners."""
    for i in range(columns.shape[1]):
        p = columns[0, i] * share[0, 0] + columns[1, i] * share[0, 1] + columns[2, i] * share[0, 2]
        q = columns[0, i] * share[1, 0] + columns[1, i] * share[1, 1] + columns[2, i] * share[1, 2]
        at_b[i] += p
        at_c[i] += q
        at_a[i] -= p + q
