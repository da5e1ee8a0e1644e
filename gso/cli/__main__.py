"""Run the command line without its entry point: ``python -m gso.cli``."""

from gso.cli import main

main(prog_name="gso")
