"""Body stage: strain or stress at each element from the surface pressure (E maps)."""
