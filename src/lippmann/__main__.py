"""``python -m lippmann``: the command ``lippmann`` of this Python, where its scripts are not on the path."""

from lippmann.cli import main

if __name__ == "__main__":
    main()
