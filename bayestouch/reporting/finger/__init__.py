"""What a report on a finger has of its own."""
