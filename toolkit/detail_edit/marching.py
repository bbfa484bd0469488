"""Distances along a triangle mesh by fast marching, compiled; the front stops at a limit, so that a brush stays local.

A triangle hands the distances of two corners on to the third: as a circular wave if both come from the same seed (the
seed is unfolded into the triangle's plane; exact on flat ground; Novotni and Klein 2002), else as a plane one, which is
what the wave round a curve is (Kimmel and Sethian 1998).
"""

from __future__ import annotations

import heapq

import numpy as np

from toolkit.compiled import njit

__all__ = ["march", "seeds_round"]

_OPTIONS = {"cache": True, "nogil": True, "fastmath": False, "boundscheck": False}


@njit(**_OPTIONS)
def _corner(p, q):
    x, y, z = p[0] - q[0], p[1] - q[1], p[2] - q[2]
    return np.sqrt(x * x + y * y + z * z)


@njit(**_OPTIONS)
def _through(p, q, r, from_p, from_q, same):
    """Distance at r from those at p and q, and whether the wave enters nearer to p; infinite if it comes from aside."""
    c, b, a = _corner(p, q), _corner(p, r), _corner(q, r)
    if c <= 0:
        return np.inf, True
    x = (b * b - a * a + c * c) / (2 * c)
    y = np.sqrt(max(b * b - x * x, 0.0))
    if same:
        sx = (from_p * from_p - from_q * from_q + c * c) / (2 * c)
        square = from_p * from_p - sx * sx
        if square < 0:
            return np.inf, True
        sy = np.sqrt(square)
        enters = sx + (x - sx) * sy / max(y + sy, 1e-300)
        found = np.sqrt((x - sx) ** 2 + (y + sy) ** 2)
    else:
        gx = (from_q - from_p) / c
        if gx * gx >= 1:
            return np.inf, True
        gy = np.sqrt(1 - gx * gx)
        enters = x - gx * y / gy
        found = from_p + gx * x + gy * y
    if enters < 0 or enters > c:
        return np.inf, True
    return found, 2 * enters < c


@njit(**_OPTIONS)
def seeds_round(points, triangles, first, around, places, at):
    """Vertices round surface points to start from, their straight distances, and which point each belongs to.

    ``places`` (n, 3) and the triangles ``at`` (n,) that they lie in; the vertices of all triangles that touch these.
    """
    total = 0
    for k in range(at.shape[0]):
        for corner in range(3):
            v = triangles[at[k], corner]
            total += 3 * (first[v + 1] - first[v])
    seeds, labels, starts = np.empty(total, np.int64), np.empty(total, np.int64), np.empty(total)
    n = 0
    for k in range(at.shape[0]):
        for corner in range(3):
            v = triangles[at[k], corner]
            for j in range(first[v], first[v + 1]):
                for other in range(3):
                    w = triangles[around[j], other]
                    seeds[n], labels[n], starts[n] = w, k, _corner(points[w], places[k])
                    n += 1
    return seeds, starts, labels


@njit(**_OPTIONS)
def march(points, triangles, first, around, seeds, starts, labels, limit):
    """Distance ``(V,)`` from the seeds along the mesh, infinite beyond ``limit``, and the nearest one's label ``(V,)``.

    ``first`` (V + 1,) and ``around`` list the triangles at each vertex; ``seeds`` (S,) vertices, ``starts`` (S,) their
    distances at the start and ``labels`` (S,) whom they belong to.
    """
    n = points.shape[0]
    distance = np.full(n, np.inf)
    label = np.full(n, -1, np.int64)
    done = np.zeros(n, np.bool_)
    front = [(0.0, 0)]
    front.pop()
    for k in range(seeds.shape[0]):
        v = seeds[k]
        if starts[k] < distance[v]:
            distance[v], label[v] = starts[k], labels[k]
    for k in range(seeds.shape[0]):
        v = seeds[k]
        if label[v] == labels[k] and distance[v] == starts[k] and not done[v]:
            heapq.heappush(front, (distance[v], np.int64(v)))
            done[v] = True  # that it waits, so that a seed given twice waits once
    done[:] = False
    while len(front) > 0:
        d, v = heapq.heappop(front)
        if done[v]:
            continue
        if d > limit:
            break
        done[v] = True
        for k in range(first[v], first[v + 1]):
            f = around[k]
            for corner in range(3):
                if triangles[f, corner] == v:
                    a, b = triangles[f, (corner + 1) % 3], triangles[f, (corner + 2) % 3]
            for _ in range(2):
                a, b = b, a
                if done[a]:
                    continue
                found, owner = d + _corner(points[v], points[a]), label[v]
                if done[b]:
                    better, near = _through(points[v], points[b], points[a], d, distance[b], label[v] == label[b])
                    if better < found:
                        found = better
                        if not near:
                            owner = label[b]
                if found < distance[a]:
                    distance[a], label[a] = found, owner
                    heapq.heappush(front, (found, np.int64(a)))
    for v in range(n):
        if not done[v]:
            distance[v], label[v] = np.inf, -1
    return distance, label
