"""``python -m femprep``: the command line."""

from __future__ import annotations

import sys

from femprep.cli import main

sys.exit(main())
