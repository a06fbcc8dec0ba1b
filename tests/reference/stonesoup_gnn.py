"""Stone Soup's tracker of the same kind: extended Kalman filters and global nearest neighbours, its own classes."""

from __future__ import annotations

import datetime
import math
from collections.abc import Iterator, Sequence
from importlib import import_module
from typing import Any

import numpy as np

from mapping.geometry.arrays import F64
from mapping.tracking.tracker_params import TrackerParams
from tests.mapping.radar_scenes import Frame

START = datetime.datetime(2026, 1, 1)
FORGOTTEN_M2 = 12.0
"""Variance of the place, both axes together: some three seconds without a detection."""


def follow(frames: Sequence[Frame], params: TrackerParams) -> Iterator[F64]:
    """(N, 4) east, north and their velocities of all confirmed tracks, frame by frame; told the same as ours.

    Its states are (east, east speed, north, north speed).
    """
    tracker = _tracker(params, frames[1].t_s - frames[0].t_s, [_detections(frame, params) for frame in frames])
    for _, tracks in tracker:
        states = [np.asarray(track.state_vector, np.float64)[:, 0] for track in tracks]
        yield np.array(states).reshape(-1, 4)[:, [0, 2, 1, 3]]


def _tracker(params: TrackerParams, every_s: float, frames: list[Any]) -> Any:
    linear = _of("models.transition.linear")
    axis = linear.ConstantVelocity(params.acceleration_m_s2**2 * every_s)
    predictor = _of("predictor.kalman").ExtendedKalmanPredictor(
        linear.CombinedLinearGaussianTransitionModel([axis, axis])
    )
    updater = _of("updater.kalman").ExtendedKalmanUpdater(None)
    hypothesiser = _of("hypothesiser.distance").DistanceHypothesiser(
        predictor, updater, _of("measures").Mahalanobis(), missed_distance=math.sqrt(params.gate)
    )
    associator = _of("dataassociator.neighbour").GNNWith2DAssignment(hypothesiser)
    deleter = _of("deleter.error").CovarianceBasedDeleter(FORGOTTEN_M2, mapping=[0, 2])
    initiator = _of("initiator.simple").MultiMeasurementInitiator(
        prior_state=None,
        deleter=deleter,
        data_associator=associator,
        updater=updater,
        min_points=params.birth_updates,
        initiator=_first_state(params),
    )
    return _of("tracker.simple").MultiTargetTracker(initiator, deleter, frames, associator, updater)


def _detections(frame: Frame, params: TrackerParams) -> tuple[datetime.datetime, set[Any]]:
    """Its bearings count from east, to the left."""
    array, when = _of("types.array"), START + datetime.timedelta(seconds=frame.t_s)
    bearing_type = _of("types.angle").Bearing
    own, own_m_s = frame.position_enu_m[:, None], frame.velocity_enu_m_s[:, None]
    found = set()
    for range_m, off_nose, radial_speed in frame.detections:
        bearing = params.bearing_sigma_rad**2 + (params.extent_m / range_m) ** 2
        model = _of("models.measurement.nonlinear").CartesianToBearingRangeRate2D(
            ndim_state=4,
            mapping=(0, 2),
            velocity_mapping=(1, 3),
            noise_covar=array.CovarianceMatrix(
                np.diag([bearing, params.range_sigma_m**2 + params.extent_m**2, params.radial_speed_sigma_m_s**2])
            ),
            translation_offset=array.StateVector(own),
            velocity=array.StateVector(own_m_s),
        )
        towards = math.pi / 2 - off_nose - frame.heading_rad
        vector = array.StateVector([[bearing_type(towards)], [range_m], [radial_speed]])
        found.add(_of("types.detection").Detection(vector, timestamp=when, measurement_model=model))
    return when, found


def _first_state(params: TrackerParams) -> Any:
    """An initiator as ours: the radial speed is measured, across it the object stands still."""
    track, update, array = _of("types.track"), _of("types.update"), _of("types.array")

    class FirstState(_of("initiator.base").Initiator):
        def initiate(self, detections: set[Any], timestamp: Any, **kwargs: Any) -> set[Any]:
            return {track.Track([self._state(detection)]) for detection in detections}

        def _state(self, detection: Any) -> Any:
            model = detection.measurement_model
            bearing, range_m, radial = (float(value) for value in detection.state_vector[:, 0])
            unit = np.array([math.cos(bearing), math.sin(bearing)])
            across = np.array([-unit[1], unit[0]])
            own, own_m_s = np.asarray(model.translation_offset)[:, 0], np.asarray(model.velocity)[:, 0]
            place, velocity = own + range_m * unit, (radial + unit @ own_m_s) * unit
            var = np.diag(np.asarray(model.noise_covar, np.float64))
            of_place = var[1] * np.outer(unit, unit) + var[0] * range_m**2 * np.outer(across, across)
            of_velocity = var[2] * np.outer(unit, unit) + params.speed_m_s**2 * np.outer(across, across)
            covariance = np.zeros((4, 4))
            covariance[np.ix_([0, 2], [0, 2])], covariance[np.ix_([1, 3], [1, 3])] = of_place, of_velocity
            return update.GaussianStateUpdate(
                array.StateVector([place[0], velocity[0], place[1], velocity[1]]),
                array.CovarianceMatrix(covariance),
                hypothesis=_of("types.hypothesis").SingleHypothesis(None, detection),
                timestamp=detection.timestamp,
            )

    return FirstState()


def _of(module: str) -> Any:
    """Its classes describe themselves when they are made: no types."""
    return import_module(f"stonesoup.{module}")
