"""What a render can be asked for, each option once: command line, Python, studio and files are made from these."""
