"""`python -m msfp_gen`."""

from msfp_gen.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
