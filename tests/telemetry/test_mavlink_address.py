"""Link strings: both spellings, and everything that must never be opened."""

from pathlib import Path

import pytest

from telemetry.errors import AddressError
from telemetry.mavlink.address import Address, parse_address, parse_addresses, refuse_file


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("udpin:0.0.0.0:14550", Address("udpin", "0.0.0.0", 14550)),
        ("udpin://0.0.0.0:14550", Address("udpin", "0.0.0.0", 14550)),
        ("udp:127.0.0.1:14540", Address("udpin", "127.0.0.1", 14540)),
        ("udp://:14550", Address("udpin", "0.0.0.0", 14550)),
        ("UDPOUT:drone.local:14551", Address("udpout", "drone.local", 14551)),
        ("tcp:192.168.1.5", Address("tcpout", "192.168.1.5", 5760)),
        ("tcpout://192.168.1.5:5762", Address("tcpout", "192.168.1.5", 5762)),
        ("tcpin:[::1]:5760", Address("tcpin", "::1", 5760)),
        ("/dev/ttyACM0", Address("serial", device="/dev/ttyACM0", baud=57600)),
        ("/dev/ttyUSB3:115200", Address("serial", device="/dev/ttyUSB3", baud=115200)),
        ("/dev/ttyUSB3,921600", Address("serial", device="/dev/ttyUSB3", baud=921600)),
        ("serial:///dev/ttyACM0:57600", Address("serial", device="/dev/ttyACM0", baud=57600)),
        ("serial:/dev/ttyACM0", Address("serial", device="/dev/ttyACM0", baud=57600)),
        (
            "/dev/serial/by-path/pci-0000:00:14.0-usb-0:1:1.0:57600",
            Address("serial", device="/dev/serial/by-path/pci-0000:00:14.0-usb-0:1:1.0", baud=57600),
        ),
    ],
)
def test_both_spellings(text: str, address: Address) -> None:
    assert parse_address(text) == address


@pytest.mark.parametrize(
    "text", ["udpin:0.0.0.0:14550", "tcp:[::1]:5760", "tcpin:127.0.0.1:1", "/dev/ttyACM0:57600", "udpout:drone:14550"]
)
def test_an_address_has_one_spelling_of_its_own(text: str) -> None:
    assert parse_address(text).text == text
    assert parse_address(parse_address(text).text) == parse_address(text)


@pytest.mark.parametrize(
    ("text", "about"),
    [
        ("", "no connection"),
        ("nonsense", "no connection"),
        ("/etc/passwd", "no serial device"),
        ("/dev/../etc/passwd", "no serial device"),
        ("/dev/serial/by-id/../../sda", "no serial device"),
        ("/dev/mem", "no serial device"),
        ("/dev/tty", "no serial device"),
        ("serial:///etc/passwd:57600", "no serial device"),
        ("serial:flight.tlog", "no serial device"),
        ("flight.tlog", "no connection"),
        ("file:///etc/passwd", "no connection"),
        ("http://example.org:80", "no connection"),
        ("mcast:", "no connection"),
        ("C:\\logs\\flight.bin", "no connection"),
        ("tcp:", "which host"),
        ("udpout::14550", "which host"),
        ("tcp:host:0", "no port"),
        ("tcp:host:65536", "no port"),
        ("tcp:host:-1", "no port"),
        ("tcp:host:57x", "no port"),
        ("udpin:0.0.0.0:99999999999999999999", "no port"),
        ("tcp:host:5760:1", "cannot|can be read"),
        ("tcp:ho st:5760", "no host name"),
        ("tcp:host;rm -rf:5760", "no host name"),
        ("tcp:host/path:5760", "can be read"),
        ("/dev/ttyACM0:1", "no baud rate"),
        ("/dev/ttyACM0:999999999", "no baud rate"),
    ],
)
def test_what_is_not_on_the_list_is_refused_in_words(text: str, about: str) -> None:
    with pytest.raises(AddressError, match=about) as caught:
        parse_address(text)
    assert caught.value.advice


def test_an_endless_text_is_cut_short_in_the_error() -> None:
    with pytest.raises(AddressError) as caught:
        parse_address("x" * 100_000)
    assert len(caught.value.what) < 300


def test_a_file_in_the_place_of_a_device_is_not_opened(tmp_path: Path) -> None:
    file = tmp_path / "ttyACM0"
    refuse_file(file, "not there yet")
    file.write_text("secret")
    with pytest.raises(AddressError, match="a file or folder"):
        refuse_file(file, str(file))
    refuse_file(Path("/dev/null"), "a character device")


def test_several_ways_stand_with_commas_between_and_each_once() -> None:
    found = parse_addresses("udpin:0.0.0.0:14550, /dev/ttyUSB0:57600")
    assert [each.text for each in found] == ["udpin:0.0.0.0:14550", "/dev/ttyUSB0:57600"]
    assert parse_addresses("tcp:10.0.0.7:5760") == (parse_address("tcp:10.0.0.7:5760"),)
    for wrong, words in (
        ("", "No connection"),
        (" , ", "No connection"),
        ("tcp:a:1,tcp:a:1", "twice"),
        ("tcp:a:1,x", "x"),
    ):
        with pytest.raises(AddressError, match=words):
            parse_addresses(wrong)
