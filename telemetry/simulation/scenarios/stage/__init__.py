"""What every scenario is played on: places, flights in virtual time, figures and results."""
