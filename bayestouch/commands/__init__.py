"""The commands of the command line, one file each: their options, and the printing of results."""
