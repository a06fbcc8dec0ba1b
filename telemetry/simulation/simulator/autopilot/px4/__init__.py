"""How PX4 flies a multirotor: its trajectory, its controller, its flight modes, its commander."""
