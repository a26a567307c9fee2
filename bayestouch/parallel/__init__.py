"""Work on several processes and on a Dask cluster."""
