"""A node that is loaded and waits: ``python -m telemetry.bus.spare_node MODULE``.

It runs ``MODULE.main`` with the arguments that come in one line on its standard input, a JSON list, and ends where that
closes: whoever would have needed it is gone.
"""

from __future__ import annotations

import importlib
import json
import sys


def main() -> int:
    module = importlib.import_module(sys.argv[1])
    line = sys.stdin.readline()
    if not line.endswith("\n"):
        return 0
    sys.argv[1:] = json.loads(line)
    return module.main()


if __name__ == "__main__":
    sys.exit(main())
