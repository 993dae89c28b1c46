"""The report of a run, on one page that opens anywhere."""
