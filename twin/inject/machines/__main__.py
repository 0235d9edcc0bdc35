"""python -m twin.inject.machines SEED FOLDER [boxes|lumped]."""

from __future__ import annotations

import sys

from twin.inject.machines.drawn import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
