"""Parameter sweeps: runs that are handed over as they end, and one table of all of them (docs/batch.md)."""

from msfp_gen.studies.sweep.runs import completed_runs
from msfp_gen.studies.sweep.table import TABLE_SUFFIXES, Row, row_of, sweep_table, write_table

__all__ = ["TABLE_SUFFIXES", "Row", "completed_runs", "row_of", "sweep_table", "write_table"]
