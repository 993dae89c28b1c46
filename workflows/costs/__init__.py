"""What a run costs, before it: time by a calibration, memory and disk."""
