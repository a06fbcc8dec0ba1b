"""From a path to the items that an autopilot flies, and back to the line that those items really describe."""
