# SPDX-License-Identifier: GPL-3.0-or-later
"""Sparse weights of many vertices at once: non-negative, of sum 1, few of them above 0."""

import numpy as np

# Added to the diagonal, as a share of its mean: the Gram matrix of equal candidates is singular.
_RIDGE = 1e-10
# The least improvement that counts, as a share of the objective's scale.
_TOLERANCE = 1e-9


def sparse_weights(grams: np.ndarray, allowed: np.ndarray, most: int) -> np.ndarray:
    """For each row, finds weights w that make w G w small: of sum 1, none below 0, at most `most` above 0.

    grams    float64 [rows, candidates, candidates], G: products of the candidates' errors
    allowed  bool [rows, candidates], at least one in each row

    Returns float64 [rows, candidates]. Where `most` is no limit they are optimal; otherwise they are the
    better result of two searches: adding candidates one by one, and keeping the largest of the best unlimited
    weights.

    This is the point of the convex hull of the errors that is nearest to 0: P. Wolfe, *Finding the nearest
    point in a polytope* (1976).
    """
    size = np.trace(grams, axis1=1, axis2=2) / grams.shape[1]
    scaled = grams / np.where(size > 0.0, size, 1.0)[:, None, None]
    scaled += _RIDGE * np.identity(grams.shape[1])
    best = _nearest_point(scaled, allowed, grams.shape[1])
    crowded = (best > 0.0).sum(axis=1) > most
    if crowded.any():
        best[crowded] = _limited(scaled[crowded], allowed[crowded], best[crowded], most)
    return best


def objective(grams: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """float64 [rows]: w G w."""
    return np.einsum("ri,rij,rj->r", weights, grams, weights, optimize=True)


def _limited(grams: np.ndarray, allowed: np.ndarray, unlimited: np.ndarray, most: int) -> np.ndarray:
    grown = _nearest_point(grams, allowed, most)
    # Losing a candidate moves the vertex by its weight times the size of its error.
    effect = unlimited * np.sqrt(np.einsum("rii->ri", grams))
    kept = np.zeros_like(allowed)
    np.put_along_axis(kept, np.argpartition(-effect, most - 1, axis=1)[:, :most], True, axis=1)
    cut = _nearest_point(grams, kept & allowed, most)
    is_better = objective(grams, cut) < objective(grams, grown)
    return np.where(is_better[:, None], cut, grown)


def _nearest_point(grams: np.ndarray, allowed: np.ndarray, most: int) -> np.ndarray:
    """Wolfe's algorithm; it adds no more candidates once `most` are in use."""
    rows, candidates = allowed.shape
    diagonal = np.where(allowed, np.einsum("rii->ri", grams), np.inf)
    weights = np.zeros((rows, candidates))
    weights[np.arange(rows), diagonal.argmin(axis=1)] = 1.0
    active = np.arange(rows)
    for _step in range(4 * candidates):
        gradient = np.einsum("rij,rj->ri", grams[active], weights[active])
        now = weights[active]
        used = now > 0.0
        free = allowed[active] & ~used & (used.sum(axis=1) < most)[:, None]
        gradient_there = np.where(free, gradient, np.inf)
        entering = gradient_there.argmin(axis=1)
        gain = (now * gradient).sum(axis=1) - gradient_there[np.arange(len(active)), entering]
        goes_on = gain > _TOLERANCE
        active, used, entering = active[goes_on], used[goes_on], entering[goes_on]
        if not len(active):
            break
        used[np.arange(len(active)), entering] = True
        weights[active] = _best_of_used(grams[active], weights[active], used)
    return weights


def _best_of_used(grams: np.ndarray, weights: np.ndarray, used: np.ndarray) -> np.ndarray:
    """The best weights of the used candidates; those that would be negative are removed, one after
    another."""
    result = weights.copy()
    open_rows = np.arange(len(grams))
    for _step in range(grams.shape[1]):
        aim = _affine_minimum(grams[open_rows], used[open_rows])
        now = result[open_rows]
        below = used[open_rows] & (aim < 0.0)
        room = np.where(below, now / np.where(below, now - aim, 1.0), np.inf)
        share = np.minimum(room.min(axis=1), 1.0)
        moved = np.maximum(now + share[:, None] * (aim - now), 0.0)
        # Exactly 0 for removed candidates, in spite of rounding.
        leaves = below & (room <= share[:, None])
        moved[leaves] = 0.0
        result[open_rows] = moved / moved.sum(axis=1, keepdims=True)
        used[open_rows] &= ~leaves
        open_rows = open_rows[leaves.any(axis=1)]
        if not len(open_rows):
            break
    return result


def _affine_minimum(grams: np.ndarray, used: np.ndarray) -> np.ndarray:
    """The smallest w G w for weights of sum 1, of any sign, that are 0 for unused candidates: in the
    direction of the solution of G w = 1."""
    rows, count = len(used), int(used.sum(axis=1).max())
    # Only used candidates: the others would make the systems larger.
    slots = np.argsort(~used, axis=1, kind="stable")[:, :count]
    at = np.arange(rows)[:, None]
    is_used = used[at, slots].T
    # The rows are the last axis: [candidates, candidates, rows].
    own = grams[at[:, :, None], slots[:, :, None], slots[:, None, :]].transpose(1, 2, 0)
    both = is_used[:, None] & is_used[None]
    system = np.where(both, own, np.identity(count)[:, :, None] * ~is_used)
    solved = _solved(system, is_used.astype(np.float64))
    result = np.zeros(used.shape)
    result[at, slots] = (np.where(is_used, solved, 0.0) / solved.sum(axis=0)).T
    return result


def _solved(system: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solves many small positive definite systems, [n, n, rows] and [n, rows], by elimination; overwrites
    both.

    Not with LAPACK: numpy's uses threads even for these, which wait for each other on a busy machine.
    """
    count = len(system)
    for pivot in range(count):
        for row in range(pivot + 1, count):
            factor = system[row, pivot] / system[pivot, pivot]
            system[row, pivot + 1 :] -= factor * system[pivot, pivot + 1 :]
            right[row] -= factor * right[pivot]
    for row in reversed(range(count)):
        right[row] -= (system[row, row + 1 :] * right[row + 1 :]).sum(axis=0)
        right[row] /= system[row, row]
    return right
