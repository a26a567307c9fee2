"""Published numbers of Nicolson and Fearing (1995), and their fitting methods."""
