"""The command line as a module: ``python -m gso.cli``."""

from gso.cli import main

if __name__ == "__main__":
    main(prog_name="gso")
