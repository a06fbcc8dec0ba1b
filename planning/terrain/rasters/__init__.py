"""How raster files are opened: decoding in a child process, everything else as arithmetic on its numbers."""
