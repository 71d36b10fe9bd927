"""One image on many workers, by Dask."""
