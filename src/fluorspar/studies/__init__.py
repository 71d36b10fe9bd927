"""Studies: tables of renders, made one after another or by many workers, and found again by an index."""
