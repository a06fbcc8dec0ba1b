"""`make bench`: run the `main()` of every `bench_*.py` in this folder, one after the other."""

import importlib
import pkgutil

from tests import bench


def main() -> None:
    names = sorted(module.name for module in pkgutil.iter_modules(bench.__path__) if module.name.startswith("bench_"))
    for name in names:
        print(f"== {name.removeprefix('bench_')}")
        importlib.import_module(f"{bench.__name__}.{name}").main()


if __name__ == "__main__":
    main()
