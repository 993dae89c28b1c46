"""The algorithms, the stages, and the Dask graph that joins them: NumPy and Arrow in and out."""
