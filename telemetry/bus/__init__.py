"""The bus between Hedgehop's processes on one machine: publish, subscribe and call, over Unix sockets, no open port."""
