"""Writers: a `Motion` becomes a file that other programs read."""

from motionary.pipeline.writers.bvh import write_bvh
from motionary.pipeline.writers.npz import write_npz
from motionary.pipeline.writers.whole import whole_file

__all__ = ["whole_file", "write_bvh", "write_npz"]
