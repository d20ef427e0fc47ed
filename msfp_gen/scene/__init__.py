"""Input of one run: bearing, top, solver and scene, and the selection of effects from them."""
