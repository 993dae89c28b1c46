"""What counts as constant: movement that is no more than rounding has no shape to correlate."""

from __future__ import annotations

import numpy as np

from motionary.pipeline.motion import FloatArray


def rounding_level(values: FloatArray) -> FloatArray:
    """Return the standard deviation up to which a DOF counts as constant (dofs,).

    That is four roundings of its largest value in the dtype given (float32 features are coarser than their
    arithmetic), and at least 1e-12 of the largest value of all: a joint that lies on an axis keeps noise
    from the arithmetic of the whole body, which is large beside its own size.

    Parameters
    ----------
    values : array (..., dofs)
        In the dtype in which they were made.
    """
    dtype = values.dtype if np.issubdtype(values.dtype, np.floating) else np.float64
    largest = np.abs(values).reshape(-1, values.shape[-1]).max(axis=0).astype(np.float64)
    return np.maximum(4 * float(np.finfo(dtype).eps) * largest, 1e-12 * largest.max())
