"""Parallel computation in several processes and on a Dask cluster."""
