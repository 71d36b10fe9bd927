"""The staged method: the paper's procedure on a renderer that knows three linear bands and no
fluorescence."""
