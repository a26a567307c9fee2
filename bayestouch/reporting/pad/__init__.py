"""What a report on a pad has of its own."""
