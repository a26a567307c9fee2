"""Body stage: surface pressure to the strain or stress that an element sees (E maps)."""
