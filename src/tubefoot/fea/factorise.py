"""Factorisation of the sparse symmetric tangent: MKL PARDISO, or SuperLU where there is no MKL."""

from __future__ import annotations

import ctypes
import sys
from functools import cache
from importlib.metadata import PackageNotFoundError, files
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class Factoriser(Protocol):
    """Factorises matrices of one pattern and solves with the last one."""

    name: str
    negative_pivots: int | None
    """Negative eigenvalues of the last matrix, None where the library does not tell."""
    flops: float | None
    """Floating-point operations of one factorisation, None where the library does not tell."""
    nonzeros: int | None
    """Entries of the factors, None where the library does not tell."""

    def factorise(self, data: FloatArray) -> None:
        """Factorise the matrix with these values of the upper triangle.

        data : CSR values in the order of the pattern
        """

    def solve(self, right: FloatArray) -> FloatArray:
        """Solutions, same shape as the right-hand sides.

        right : (n, k) right-hand sides
        """


class SingularMatrixError(ArithmeticError):
    """The tangent could not be factorised."""


def factoriser(indptr: NDArray[Any], indices: NDArray[Any]) -> Factoriser:
    """The fastest factoriser this machine has.

    indptr, indices : CSR pattern of the upper triangle, columns sorted
    """
    try:
        return Pardiso(indptr, indices)
    except ImportError:
        return SuperLU(indptr, indices)


@cache
def _math_library() -> Any:
    """MKL as the Python package `mkl` installs it; ImportError where there is none."""
    try:
        found = [file for file in files("mkl") or [] if "mkl_rt" in file.name]
        return ctypes.CDLL(str(found[0].locate()))
    except (PackageNotFoundError, IndexError, OSError) as error:
        raise ImportError("the package mkl is not installed or has no mkl_rt library") from error


class Pardiso:
    """MKL PARDISO for symmetric indefinite matrices; the symbolic analysis is done once."""

    name = "MKL PARDISO"

    def __init__(self, indptr: NDArray[Any], indices: NDArray[Any]):
        """Load MKL.

        indptr, indices : CSR pattern of the upper triangle

        Raises ImportError where there is no MKL.
        """
        self._call = _math_library().pardiso
        self._call.restype = None
        self._n = len(indptr) - 1
        self._rows, self._columns = (np.asarray(a, np.int32) + np.int32(1) for a in (indptr, indices))
        self._handle = np.zeros(64, np.int64)
        self._options = np.zeros(64, np.int32)
        self._options[[0, 1, 9, 10, 12, 17]] = 1, 2, 8, 0, 0, -1
        # METIS ordering (nested dissection), pivot perturbation 1e-8, no scaling or matching
        # (both would tie the analysis to the values), report flops and pivots.
        self._options[18] = -1
        self._options[7] = 1  # at most one step of iterative refinement, only where a pivot was perturbed
        self._data: FloatArray = np.zeros(0)
        self._analysed = False
        self.negative_pivots: int | None = None
        self.flops: float | None = None
        self.nonzeros: int | None = None

    def factorise(self, data: FloatArray) -> None:
        """Factorise, with the symbolic analysis on the first call.

        data : CSR values

        Raises SingularMatrixError when PARDISO gives up or the values are not finite.
        """
        if not np.isfinite(data).all():
            raise SingularMatrixError("the tangent has entries that are not finite")
        self._data = data
        if not self._analysed:
            self._run(11, np.zeros((self._n, 1), order="F"))
            self._analysed = True
            self.flops = 1e6 * float(self._options[18])
            self.nonzeros = int(self._options[17])
        self._run(22, np.zeros((self._n, 1), order="F"))
        self.negative_pivots = int(self._options[22])

    def solve(self, right: FloatArray) -> FloatArray:
        """Solutions for the last matrix.

        right : (n, k)
        """
        return self._run(33, np.asfortranarray(right))

    def _run(self, phase: int, right: FloatArray) -> FloatArray:
        def integer(value: int) -> Any:
            return ctypes.byref(ctypes.c_int32(value))

        def pointer(array: NDArray[Any], kind: Any = ctypes.c_int32) -> Any:
            return array.ctypes.data_as(ctypes.POINTER(kind))

        solution = np.zeros_like(right)
        error = ctypes.c_int32(0)
        self._call(
            pointer(self._handle, ctypes.c_int64),
            integer(1),
            integer(1),
            integer(-2),
            integer(phase),
            integer(self._n),
            pointer(self._data, ctypes.c_double),
            pointer(self._rows),
            pointer(self._columns),
            pointer(np.zeros(0, np.int32)),
            integer(right.shape[1]),
            pointer(self._options),
            integer(0),
            pointer(right, ctypes.c_double),
            pointer(solution, ctypes.c_double),
            ctypes.byref(error),
        )
        if error.value != 0:
            raise SingularMatrixError(f"PARDISO error {error.value} in phase {phase}")
        return solution

    def __del__(self) -> None:
        if getattr(self, "_analysed", False) and not sys.is_finalizing():
            self._run(-1, np.zeros((self._n, 1), order="F"))


class SuperLU:
    """SciPy's SuperLU on the full matrix: slower, everywhere available."""

    name = "SuperLU"
    negative_pivots: int | None = None
    flops: float | None = None
    nonzeros: int | None = None

    def __init__(self, indptr: NDArray[Any], indices: NDArray[Any]):
        """Keep the pattern.

        indptr, indices : CSR pattern of the upper triangle
        """
        self._pattern = (indices, indptr)
        self._n = len(indptr) - 1

    def factorise(self, data: FloatArray) -> None:
        """Factorise.

        data : CSR values

        Raises SingularMatrixError when the matrix is singular or not finite.
        """
        if not np.isfinite(data).all():
            raise SingularMatrixError("the tangent has entries that are not finite")
        upper = sp.csr_matrix((data, *self._pattern), shape=(self._n, self._n))
        full = (upper + sp.triu(upper, 1).T).tocsc()
        try:
            self._factors = scipy.sparse.linalg.splu(full, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01)
        except RuntimeError as error:
            raise SingularMatrixError(str(error)) from error

    def solve(self, right: FloatArray) -> FloatArray:
        """Solutions for the last matrix.

        right : (n, k)
        """
        return self._factors.solve(np.asarray(right))
