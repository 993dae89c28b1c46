"""Writers: a `Motion` becomes a file that other programs read."""

from motionary.pipeline.writers.bvh import write_bvh

__all__ = ["write_bvh"]
