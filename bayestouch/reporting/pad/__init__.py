"""Parts of a report that only a pad has."""
