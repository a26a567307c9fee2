"""What Nicolson and Fearing (1995) printed, and their own methods."""
