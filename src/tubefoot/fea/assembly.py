"""The sparse system: the pattern of all items, and the sums of their element parts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numba import njit, prange
from numpy.typing import NDArray

from tubefoot.fea.items import Evaluation, Item, State

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@njit(cache=True, parallel=True)
def find_slots(free_pattern, indptr, indices, slots):  # type: ignore[no-untyped-def]
    """Write where each entry of the element matrices lies in the upper triangle, -1 for fixed unknowns.

    free_pattern : (n_elements, m) row numbers, -1 for fixed; indptr, indices : CSR upper triangle
    slots : (n_elements, m (m + 1) / 2) out, row by row from the diagonal
    """
    n_elements, m = free_pattern.shape
    for element in prange(n_elements):
        k = 0
        for a in range(m):
            for b in range(a, m):
                i, j = free_pattern[element, a], free_pattern[element, b]
                slots[element, k] = -1
                if i >= 0 and j >= 0:
                    row, column = min(i, j), max(i, j)
                    low, high = indptr[row], indptr[row + 1]
                    while low < high:
                        middle = (low + high) // 2
                        if indices[middle] < column:
                            low = middle + 1
                        else:
                            high = middle
                    slots[element, k] = low
                k += 1


@njit(cache=True)
def scatter_residuals(residuals, pattern, residual):  # type: ignore[no-untyped-def]
    """Add element residuals to the global one.

    residuals : (n, m); pattern : (n, m) numbers of the unknowns; residual : (n_unknowns,) in and out
    """
    for element in range(pattern.shape[0]):
        for a in range(pattern.shape[1]):
            residual[pattern[element, a]] += residuals[element, a]


@njit(cache=True)
def scatter(matrices, residuals, slots, pattern, data, residual):  # type: ignore[no-untyped-def]
    """Add element matrices and residuals to the sparse ones.

    matrices : (n, m, m); residuals : (n, m); slots : (n, m (m + 1) / 2) of `find_slots`
    pattern : (n, m) numbers of the unknowns; data : CSR values, in and out
    residual : (n_unknowns,) in and out
    """
    n_elements, m = pattern.shape
    for element in range(n_elements):
        k = 0
        for a in range(m):
            residual[pattern[element, a]] += residuals[element, a]
            for b in range(a, m):
                slot = slots[element, k]
                if slot >= 0:
                    data[slot] += matrices[element, a, b]
                k += 1


class SparseSystem:
    """Upper triangle of the tangent over the free unknowns, and the residual over all unknowns."""

    def __init__(self, n_unknowns: int, items: Sequence[Item], fixed: NDArray[np.bool_]):
        """Find the pattern.

        n_unknowns : number of all unknowns; items : what adds to the system
        fixed : (n_unknowns,) mask of those that are held or eliminated
        """
        touched = np.zeros(n_unknowns, dtype=bool)
        for item in items:
            touched[item.pattern] = True
        self.free = np.flatnonzero(touched & ~fixed)
        self.residual = np.zeros(n_unknowns)
        number = np.full(n_unknowns, -1)
        number[self.free] = np.arange(len(self.free))
        patterns = [number[item.pattern] for item in items]
        upper = sp.triu(_couplings(patterns, len(self.free)), format="csr")
        upper.sort_indices()
        self.indptr, self.indices = upper.indptr, upper.indices
        self.data = np.zeros(len(self.indices))
        self.stiff = False
        self._slots: dict[int, NDArray[np.int32]] = {}
        for item, pattern in zip(items, patterns, strict=True):
            m = pattern.shape[1]
            slots = np.empty((len(pattern), m * (m + 1) // 2), dtype=np.int32)
            find_slots(pattern, self.indptr, self.indices, slots)
            self._slots[id(item)] = slots

    @property
    def size(self) -> int:
        """Number of free unknowns."""
        return len(self.free)

    def add(self, item: Item, first: int, matrices: FloatArray, residuals: FloatArray) -> None:
        """Add element parts, see `Sink`.

        item : the item they belong to; first : number of the first element
        matrices : (n, m, m); residuals : (n, m)
        """
        part = slice(first, first + len(residuals))
        if not self.stiff:
            scatter_residuals(residuals, item.pattern[part], self.residual)
            return
        slots = self._slots[id(item)][part]
        scatter(matrices, residuals, slots, item.pattern[part], self.data, self.residual)

    def evaluate(self, items: Sequence[Item], state: State, stiff: bool = True) -> Evaluation:
        """Assemble all items at a state into `residual` and, if `stiff`, `data`.

        items : those the system was made for; state : where to evaluate
        stiff : whether the tangent is wanted
        """
        self.stiff = stiff
        if stiff:
            self.data[:] = 0.0
        self.residual[:] = 0.0
        found = Evaluation()
        for item in items:
            item.assemble(state, self, found)
        return found

    def matrix(self) -> sp.csr_matrix:
        """The upper triangle as a sparse matrix that shares the data."""
        return sp.csr_matrix((self.data, self.indices, self.indptr), shape=(self.size, self.size))


def _couplings(patterns: Sequence[IntArray], size: int) -> sp.csr_matrix:
    """Boolean matrix of which unknowns share an element, with a full diagonal."""
    total = sp.identity(size, dtype=np.int8, format="csr")
    for pattern in patterns:
        n_elements, m = pattern.shape
        element = np.repeat(np.arange(n_elements), m)
        keep = pattern.ravel() >= 0
        entries = (np.ones(int(keep.sum()), dtype=np.int8), (element[keep], pattern.ravel()[keep]))
        incidence = sp.csr_matrix(entries, shape=(n_elements, size))
        incidence.data[:] = 1
        total = total + (incidence.T @ incidence).astype(bool).astype(np.int8)
    return total
