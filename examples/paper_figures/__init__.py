"""The figures and numbers of `examples/paper.py`, a file for each part of the paper."""
