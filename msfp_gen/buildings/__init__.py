"""Buildings on bearings: linear superstructures, their bearings, and their motion (docs/buildings.md)."""
