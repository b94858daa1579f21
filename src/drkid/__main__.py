"""`python -m drkid`."""

from drkid.cli import main

if __name__ == "__main__":
    main()
