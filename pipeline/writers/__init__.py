"""Writers: a `Motion` becomes a file that other programs read."""

from motionary.pipeline.writers.bvh import write_bvh
from motionary.pipeline.writers.csv import write_csv
from motionary.pipeline.writers.jsonl import motion_line
from motionary.pipeline.writers.npz import write_npz
from motionary.pipeline.writers.whole import whole_file

__all__ = ["motion_line", "whole_file", "write_bvh", "write_csv", "write_npz"]
