"""What the verbs return, and their files."""
