"""Quadratic programmes with linear constraints, solved by Clarabel's interior points.

    least 1/2 x^T H x + f^T x  where  E x = e and  L x <= b

Small and dense here: a row and a column a weight of a warp.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_matrix

from motionary.pipeline.motion import FloatArray


class UnsolvedError(ArithmeticError):
    """The solver ended without a solution; says with which status."""


def solve_programme(
    hessian: FloatArray,
    slope: FloatArray,
    rows: FloatArray,
    bounds: FloatArray,
    equal: FloatArray,
    exact: FloatArray,
) -> FloatArray:
    """Solve a convex quadratic programme.

    Parameters
    ----------
    hessian : array (k, k)
        H, positive semidefinite.
    slope : array (k,)
        f.
    rows : array (r, k)
        L.
    bounds : array (r,)
        b.
    equal : array (e, k)
        E.
    exact : array (e,)
        e.

    Returns
    -------
    array (k,)
        x, within the solver's tolerance (1e-8; 1e-4 where it says "almost solved").

    Raises
    ------
    UnsolvedError
        It ended otherwise than solved: what was asked has no solution, or rounding stood in the way.
    """
    import clarabel

    # The solver's tolerances are absolute as well as relative, so the objective is brought to about 1.
    scale = max(float(np.abs(hessian).max(initial=0)), float(np.abs(slope).max(initial=0)))
    if scale > 0:
        hessian, slope = hessian / scale, slope / scale
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    solver = clarabel.DefaultSolver(
        _by_columns(np.triu(hessian)),
        np.ascontiguousarray(slope),
        _by_columns(np.concatenate([equal, rows])),
        np.concatenate([exact, bounds]),
        [clarabel.ZeroConeT(len(equal)), clarabel.NonnegativeConeT(len(rows))],
        settings,
    )
    solution = solver.solve()
    if solution.status not in (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved):
        raise UnsolvedError(
            f"the quadratic programme of {len(slope)} weights ended as {solution.status} "
            f"after {solution.iterations} iterations"
        )
    return np.array(solution.x)


def _by_columns(matrix: FloatArray) -> csc_matrix:
    """Return a matrix as the solver takes it; SciPy's own way there takes as long as the solver."""
    columns, rows = np.nonzero(matrix.T)
    begins = np.searchsorted(columns, np.arange(matrix.shape[1] + 1))
    return csc_matrix((matrix[rows, columns], rows, begins), shape=matrix.shape)
