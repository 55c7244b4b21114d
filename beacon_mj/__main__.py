"""`python -m beacon_mj` is `beacon-mj`."""

from beacon_mj.cli import main

if __name__ == "__main__":
    main()
