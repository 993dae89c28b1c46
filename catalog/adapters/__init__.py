"""Chosen clips as what other libraries work on; each module wants its library installed."""
