"""Inputs that determine the equations: layout, effects, friction laws and hysteresis laws."""
