"""``python -m server``: the same as the ``hedgehop`` command."""

from server.cli import main

if __name__ == "__main__":
    main()
