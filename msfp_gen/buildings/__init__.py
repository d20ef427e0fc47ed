"""Buildings on bearings: linear superstructures, their scenes and their results (docs/buildings.md).

Frame or matrices (`storey`, `building`) -> scene (`file`, `scene`) -> run by `simulate` -> result (`result`, `summary`,
`dataset`) with extremes and notes.
"""
