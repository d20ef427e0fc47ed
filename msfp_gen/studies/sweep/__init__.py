"""Parameter sweeps: runs that are handed over as they end, and one table of all of them (docs/batch.md)."""

from msfp_gen.studies.sweep.runs import completed_runs
from msfp_gen.studies.sweep.table import (
    BUILDING_COLUMNS,
    COLUMNS,
    TABLE_SUFFIXES,
    Row,
    plain_cell,
    row_of,
    summary_value,
    sweep_table,
    write_table,
)

__all__ = [
    "BUILDING_COLUMNS",
    "COLUMNS",
    "TABLE_SUFFIXES",
    "Row",
    "completed_runs",
    "plain_cell",
    "row_of",
    "summary_value",
    "sweep_table",
    "write_table",
]
