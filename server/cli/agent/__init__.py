"""``hedgehop agent`` and ``hedgehop ros2``: sensors and robots that do not come by MAVLink."""
