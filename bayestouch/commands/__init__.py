"""The verbs of the command line, a file each; what they do is in the package, here is what they take and print."""
