"""What serves the tables and figures of Nicolson and Fearing (1995) alone."""
