"""Options of a render, each defined once: command line, Python, studio and files are made from these."""
