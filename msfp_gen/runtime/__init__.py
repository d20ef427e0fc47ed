"""The hand-written C that is compiled with every model: package data."""
