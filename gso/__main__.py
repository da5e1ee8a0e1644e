"""``python -m gso``: the command line."""

from gso.cli import main

if __name__ == "__main__":
    main(prog_name="gso")
