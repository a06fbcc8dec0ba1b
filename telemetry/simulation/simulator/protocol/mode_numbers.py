"""ArduCopter's flight modes by the numbers that stand for them on the wire."""

MODE_NUMBERS = {
    "STABILIZE": 0, "ACRO": 1, "ALT_HOLD": 2, "AUTO": 3, "GUIDED": 4, "LOITER": 5, "RTL": 6, "CIRCLE": 7, "LAND": 9,
    "DRIFT": 11, "SPORT": 13, "POSHOLD": 16, "BRAKE": 17, "SMART_RTL": 21,
}  # fmt: skip
MODE_NAMES = {number: name for name, number in MODE_NUMBERS.items()}
