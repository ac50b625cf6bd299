"""``python -m knittest``: the same as the command ``knittest``."""

from knittest.cli.main import main

if __name__ == "__main__":
    main()
