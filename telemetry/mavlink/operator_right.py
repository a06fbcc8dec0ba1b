"""Who may change anything on the vehicle: requests of an operator whose lease was taken over are refused."""

from __future__ import annotations

from telemetry.errors import NotAllowedError
from telemetry.requests import Operator


class OperatorRight:
    """Knows the highest fencing token it has seen; ``highest`` outlives a restart of the node."""

    def __init__(self, highest: int = 0) -> None:
        self.highest = highest
        self.name = ""

    def check(self, operator: Operator) -> None:
        """Raises NotAllowedError for a token lower than the highest one."""
        if operator.token < self.highest:
            by = f" by {self.name}" if self.name and self.name != operator.name else ""
            raise NotAllowedError(
                f"{operator.name or 'This session'} is not in charge any more: control was taken over{by}.",
                advice="Take control again before you command the vehicle.",
            )
        self.highest, self.name = operator.token, operator.name
