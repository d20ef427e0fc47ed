"""Compilation of generated models: C compiler, cache of compiled models, build, check of the installation."""
