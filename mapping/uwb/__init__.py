"""UWB radar against foliage: which untraversable cells of a traversability map are soft vegetation (Ahtiainen)."""

from mapping.uwb.clearing import Cleared, UwbClearing, UwbPose, clear
from mapping.uwb.params import Rule, UwbGeometry, UwbParams, in_words, of_rule
from mapping.uwb.sensor_model import BinEvidence, bin_evidence, occupied
from mapping.uwb.thresholds import Learning, Thresholds

__all__ = [
    "BinEvidence",
    "Cleared",
    "Learning",
    "Rule",
    "Thresholds",
    "UwbClearing",
    "UwbGeometry",
    "UwbParams",
    "UwbPose",
    "bin_evidence",
    "clear",
    "in_words",
    "occupied",
    "of_rule",
]
