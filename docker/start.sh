#!/bin/sh
# Numba reads compiled kernels only from a directory that it may write to, and the image's own is read-only.
set -eu
[ -d "$NUMBA_CACHE_DIR" ] || cp -R --preserve=timestamps /opt/kernels "$NUMBA_CACHE_DIR"
exec hedgehop "$@"
