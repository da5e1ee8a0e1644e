"""The report of ``bench/run_all.py``: measurement, storage and presentation."""
