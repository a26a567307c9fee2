"""How far estimates can be trusted: the paper's tables, sweet spots, what can be told apart."""
