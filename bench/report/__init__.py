"""The report of ``bench/run_all.py``: what is measured, how it is kept, how it is shown."""
