"""Undo and redo over whole plan documents: every field comes back, because the whole document does."""

from __future__ import annotations

from dataclasses import dataclass, field

from server.schemas import PlanDoc

_KEPT_STEPS, _KEPT_STEPS_LEAST = 100, 10
_KEPT_POINTS = 50_000
_COALESCE_WITHIN_S = 2.0


@dataclass(slots=True)
class History:
    """Documents in order; ``position`` is the present one. ``labels[i]`` led from document i to i + 1."""

    documents: list[PlanDoc] = field(default_factory=lambda: [PlanDoc()])
    labels: list[str] = field(default_factory=list)
    position: int = 0
    last_edit_mono_s: float = float("-inf")
    """Not kept on disk: coalescing does not outlive the session."""

    @property
    def present(self) -> PlanDoc:
        return self.documents[self.position]

    @property
    def can_undo(self) -> bool:
        return self.position > 0

    @property
    def can_redo(self) -> bool:
        return self.position < len(self.labels)

    @property
    def undo_label(self) -> str:
        return self.labels[self.position - 1] if self.can_undo else ""

    @property
    def redo_label(self) -> str:
        return self.labels[self.position] if self.can_redo else ""

    def edit(self, label: str, document: PlanDoc, *, coalesce: bool, now_mono_s: float) -> None:
        """A new present. A dragged slider (same label, ``coalesce``) stays one step."""
        recent = now_mono_s - self.last_edit_mono_s <= _COALESCE_WITHIN_S
        self.last_edit_mono_s = now_mono_s
        at_end = self.position == len(self.labels)
        if coalesce and recent and at_end and self.undo_label == label:
            self.documents[self.position] = document
            return
        del self.documents[self.position + 1 :], self.labels[self.position :]
        self.documents.append(document)
        self.labels.append(label)
        excess = max(0, len(self.labels) - _steps_that_fit(document))
        del self.documents[:excess], self.labels[:excess]
        self.position = len(self.labels)

    def undo(self) -> bool:
        """Goes one step back; False when there is none."""
        if not self.can_undo:
            return False
        self.position -= 1
        self.last_edit_mono_s = float("-inf")
        return True

    def redo(self) -> bool:
        if not self.can_redo:
            return False
        self.position += 1
        self.last_edit_mono_s = float("-inf")
        return True

    def to_json(self) -> dict[str, object]:
        return {
            "documents": [document.model_dump(mode="json") for document in self.documents],
            "labels": self.labels,
            "position": self.position,
        }

    @classmethod
    def from_json(cls, data: dict[str, object]) -> History:
        """Raises ValueError when the record contradicts itself."""
        documents, labels, position = data["documents"], data["labels"], data["position"]
        if not (isinstance(documents, list) and isinstance(labels, list) and isinstance(position, int)):
            raise ValueError("history has the wrong shape")
        if len(documents) != len(labels) + 1 or not 0 <= position <= len(labels):
            raise ValueError("history contradicts itself")
        return cls([PlanDoc.model_validate(d) for d in documents], [str(label) for label in labels], position)


def _steps_that_fit(document: PlanDoc) -> int:
    """Every step is a whole document, and all are written at every edit: thousands of points keep fewer."""
    return max(_KEPT_STEPS_LEAST, min(_KEPT_STEPS, _KEPT_POINTS // max(1, _places(document))))


def _places(document: PlanDoc) -> int:
    corners = sum(len(polygon.corners) for polygon in document.fence.polygons)
    return len(document.pois) + len(document.survey.polygon) + corners
