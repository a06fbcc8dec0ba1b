"""Ways to vehicles: UDP, TCP and serial connections that open themselves again."""

from telemetry.mavlink.address import Address
from telemetry.mavlink.connections.base import Connection, Peer, Receiver
from telemetry.mavlink.connections.serial_line import SerialLine
from telemetry.mavlink.connections.tcp import TcpClient, TcpServer
from telemetry.mavlink.connections.udp import UdpIn, UdpOut

__all__ = ["Connection", "Peer", "Receiver", "make_connection"]

_KINDS = {"udpin": UdpIn, "udpout": UdpOut, "tcpout": TcpClient, "tcpin": TcpServer, "serial": SerialLine}


def make_connection(address: Address, receiver: Receiver) -> Connection:
    """Not open yet: ``run`` opens it and keeps it open."""
    return _KINDS[address.kind](address, receiver)
