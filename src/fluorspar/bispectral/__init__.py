"""Materials, which take up light of one wavelength and give out light of another: what they are, where they come
from, and their colour under a lamp.

The folder is not called `materials`: once imported, it would hide the public function `fluorspar.materials`.
"""
