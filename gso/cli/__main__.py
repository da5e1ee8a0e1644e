"""The command line without its entry point: ``python -m gso.cli``."""

from gso.cli import main

if __name__ == "__main__":
    main(prog_name="gso")
