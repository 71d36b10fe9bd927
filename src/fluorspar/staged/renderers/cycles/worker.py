"""Runs inside Blender, not in Fluorspar, as a script with a mark as its last argument: see `inside_blender`."""

import importlib
import os
import sys

if __name__ == "__main__":
    sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
    importlib.import_module("inside_blender.serving").serve()
