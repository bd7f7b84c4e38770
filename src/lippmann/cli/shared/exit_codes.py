"""Exit codes of the command line beside 0 for success, 1 for failures of the program and 2 for bad input."""

#: After Ctrl-C.
INTERRUPTED = 130
