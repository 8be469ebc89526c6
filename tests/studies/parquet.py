"""Reads rows.parquet of a study's folder with pyarrow and DuckDB, against its journal.

    pip install pyarrow duckdb && python3 tests/studies/parquet.py out/led_accuracy
"""
import json
import sys
from pathlib import Path

import duckdb
import pyarrow.parquet as pq

folder = Path(sys.argv[1])
path = str(folder / "rows.parquet")
journal = [json.loads(line) for line in (folder / "rows.jsonl").read_text().splitlines()]
journal.sort(key=lambda row: row["index"])

table = pq.read_table(path)
for field in table.schema:
    metadata = field.metadata or {}
    assert b"unit" in metadata and metadata.get(b"meaning"), f"{field.name}: no unit or meaning"
units = {field.name: field.metadata[b"unit"].decode() for field in table.schema}
known = {"index": "1", "run_m": "m", "floor_accel_up_mps2": "m/s^2", "wall_s": "wall s"}
if "gap_m" in units:
    known |= {"speed_kmh": "km/h", "gap_m": "m", "cars": "1"}
for name, unit in known.items():
    assert units[name] == unit, f"{name} is in {units[name]}, not {unit}"

rows = table.to_pylist()
assert len(rows) == len(journal) > 0, f"{len(rows)} rows, {len(journal)} in the journal"
compared = 0
for row, line in zip(rows, journal):
    assert row["index"] == line["index"] and row["seed"] == line["seed"]
    for name, value in (line["values"] | line["figures"]).items():
        assert row[name] == value, f"run {row['index']}, {name}: {row[name]}, not {value}"
        compared += 1

sql = duckdb.connect()
source = sql.read_parquet(path)
assert source.columns == table.column_names
run_m = [row["run_m"] for row in rows if row["run_m"] is not None]
found = sql.execute("select count(*), count(run_m), max(run_m) from source").fetchone()
assert found == (len(rows), len(run_m), max(run_m)), found
[[text]] = sql.execute(
    "select value::blob from parquet_kv_metadata(?) where decode(key) = 'columns'", [path]
).fetchall()
assert {column["name"]: column["unit"] for column in json.loads(text)} == units
print(f"{len(rows)} rows of {len(units)} columns with units; {compared} values as in the journal")
