"""Public sets of motion capture: which there are, downloaded, unpacked, and labelled for a run."""
