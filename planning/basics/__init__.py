"""What every step of planning is told in: the elements of a plan, what their numbers may be, MAVLink's numbers."""
