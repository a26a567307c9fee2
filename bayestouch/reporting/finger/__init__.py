"""Parts of a report that only a finger has."""
