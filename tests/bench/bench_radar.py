"""The radar chain: false alarms and detections of its CFAR stages as set, and the time of one frame of each sensor.

Processor time of the one thread that works, so that a busy machine does not count.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from mapping.radar import fft
from mapping.radar.cfar import Cfar, Stage, doppler_stage, range_stage
from mapping.radar.chain import POSITION2GO_SETTINGS, RadarChain
from mapping.radar.radar_params import AWR1843, POSITION2GO
from mapping.tracking.tracker import Tracker
from tests.mapping.radar.cfar_maps import ca_along_doppler, caso_along_range
from tests.mapping.radar.echoes import Echo, frame, noise
from tests.reference.cfar import ca_detection

SET = 1e-3
CELLS = (1000, 1000)
EDGE = 17
"""Cells of range at either end whose sides do not lie beside them."""
PAPER_S, PAPER_FFT_S = 0.78e-3, 0.694e-3
"""Wessendorp 2021 on its Intel UP Core: one frame, and the share of its transforms."""


def main() -> None:
    for line in (*false_alarms(), *near_false_alarms(), *near_detections(), *detection_probabilities(), *frame_times()):
        print(line)


def false_alarms() -> list[str]:
    """Each stage alone on a million cells of noise, one antenna without a window and twelve with Hann's."""
    plain = np.random.default_rng(20).exponential(size=CELLS).astype(np.float32)
    along, across = _stages("rectangular", CELLS[1], CELLS[0], looks=1)
    rows = [("white noise", caso_along_range(plain, along).mean(), ca_along_doppler(plain, across).mean())]
    along, across = _stages("hann", AWR1843.samples, AWR1843.chirps, looks=12)
    chain = RadarChain(AWR1843)
    rates = np.zeros(2)
    frames = 31  # of 64 x 512 cells: just over a million
    for seed in range(frames):
        power = chain.spectra(noise(AWR1843.shape, seed)).power
        rates += caso_along_range(power, along).mean() / frames, ca_along_doppler(power, across).mean() / frames
    rows.append(("AWR1843 frames of noise, Hann", rates[0], rates[1]))
    return [_false_alarm_line(name, float(caso), float(ca)) for name, caso, ca in rows]


def _false_alarm_line(name: str, caso: float, ca: float) -> str:
    good = max(abs(caso - SET), abs(ca - SET)) <= 0.2 * SET
    return (
        f"false alarms set to {SET:g}, {name}: CASO along range {caso:.2e} ({caso / SET:.2f} times), "
        f"CA along Doppler {ca:.2e} ({ca / SET:.2f} times) (within 20 %: {_yes(good)})"
    )


def _stages(name: fft.Window, samples: int, chirps: int, *, looks: int) -> tuple[Stage, Stage]:
    padding = 1 if looks == 1 else 2
    return (
        range_stage(Cfar(4, 8, SET), name=name, samples=samples, padding=padding, looks=looks),
        doppler_stage(Cfar(2, 4, SET), name=name, chirps=chirps, padding=1, looks=looks),
    )


def near_false_alarms() -> list[str]:
    """CASO in the first and the last cells of range, whose sides run around the ring."""
    lines = []
    for name, params, padding in (("AWR1843", AWR1843, 2), ("Position2Go", POSITION2GO, 4)):
        looks, samples, blocks = len(params.antennas), params.samples, 40
        stage = range_stage(Cfar(4, 8, 10 * SET), name="hann", samples=samples, padding=padding, looks=looks)
        ends, rates = EDGE * padding, np.zeros(2)
        for seed in range(blocks):
            white = noise((40_000_000 // (looks * samples * blocks), looks, samples), seed)
            weighted = fft.windowed(white, fft.window("hann", samples), np.ones(len(white), np.float32))
            power = np.mean(np.abs(fft.range_fft(weighted, samples * padding)) ** 2, axis=1).astype(np.float32)
            above = caso_along_range(power, stage)
            rates += above[:, :ends].mean() / blocks, above[:, -ends:].mean() / blocks
        near, far = rates / (10 * SET)
        good = max(abs(near - 1.0), abs(far - 1.0)) <= 0.1
        lines.append(
            f"false alarms of CASO set to {10 * SET:g}, {name}: {near:.2f} times in the first {EDGE} cells, "
            f"{far:.2f} times in the last (0.9 to 1.1: {_yes(good)})"
        )
    return lines


def near_detections() -> list[str]:
    """A near target before a larger one of the same speed, 3 to 4 m behind it."""
    lines = []
    sensors = (
        ("Position2Go", RadarChain(POSITION2GO, POSITION2GO_SETTINGS), 10.0),
        ("AWR1843", RadarChain(AWR1843), 15.0),
    )
    for name, chain, more_db in sensors:
        for range_m in (3.0, 4.0, 5.0, 6.0):
            shares = [_seen(chain, range_m, more_db, direct) for direct in ((), (Echo(0.1, snr_db=50.0),))]
            lines.append(
                f"{name}, target of 25 dB at {range_m:g} m, another {more_db:+g} dB 3 to 4 m behind: seen in "
                f"{shares[0]:.0%} of frames, in {shares[1]:.0%} with direct coupling of 50 dB "
                f"(all: {_yes(min(shares) >= 0.99)})"
            )
    return lines


def _seen(chain: RadarChain, range_m: float, more_db: float, direct: tuple[Echo, ...], frames: int = 60) -> float:
    seen = 0
    for k in range(frames):
        larger = Echo(range_m + 3.0 + k / frames, snr_db=25.0 + more_db, phase_rad=2.3 * k)
        found = chain.process(frame(chain.params, Echo(range_m, snr_db=25.0), larger, *direct, seed=k))
        seen += bool(np.any(np.abs(found.range_m - range_m) < chain.params.range_resolution_m))
    return seen / frames


def detection_probabilities() -> list[str]:
    """A fluctuating target (Swerling 1) in the middle of noise, beside the closed form for CA-CFAR."""
    stage = doppler_stage(Cfar(2, 4, SET), name="rectangular", chirps=13, padding=1, looks=1)
    lines = [f"detection probability of CA-CFAR, 8 cells, false alarms {SET:g}: measured, closed form"]
    for snr_db in range(0, 31, 5):
        rng, snr = np.random.default_rng(snr_db), 10 ** (snr_db / 10)
        power = rng.exponential(size=(13, 100_000)).astype(np.float32)
        power[6] *= 1.0 + snr
        seen = ca_along_doppler(power, stage)[6].mean()
        lines.append(f"  {snr_db:2d} dB: {seen:.4f}, {ca_detection(8, stage.factor, snr):.4f}")
    return lines


def frame_times() -> list[str]:
    small = frame(POSITION2GO, Echo(4.0, -1.0, 0.2), Echo(7.0, 0.5, -0.4), Echo(10.0, -2.0, 0.1))
    chain, tracker, clock = RadarChain(POSITION2GO, POSITION2GO_SETTINGS), Tracker(), iter(range(1, 1_000_000))

    def tracked() -> None:
        found = chain.process(small)
        measured = np.column_stack([found.range_m, found.azimuth_rad, found.radial_speed_m_s])
        still: Any = {"position_enu_m": (0.0, 0.0), "velocity_enu_m_s": (0.0, 0.0), "heading_rad": 0.0}
        tracker.step(next(clock) / 15.7, measured, **still)

    whole_s, fft_s = _best(tracked), _best(lambda: _transforms(chain, small))
    large = frame(AWR1843, Echo(20.0, -3.0, 0.2, 0.1), Echo(50.0, 4.0, -0.4), Echo(90.0, 0.0, 0.1, snr_db=20.0))
    big = RadarChain(AWR1843)
    big_s, big_fft_s = _best(lambda: big.process(large)), _best(lambda: _transforms(big, large))
    return [
        "Position2Go frame, 2 x 16 x 64 padded to 64 x 256, transforms, detection and tracking: "
        f"{1e3 * whole_s:.3f} ms, of which the transforms {1e3 * fft_s:.3f} ms ({fft_s / whole_s:.0%}); "
        f"the paper's {1e3 * PAPER_S:.2f} ms with {1e3 * PAPER_FFT_S:.3f} ms ({PAPER_FFT_S / PAPER_S:.0%}) "
        f"(shorter: {_yes(whole_s < PAPER_S)})",
        f"AWR1843 frame, 12 x 64 x 256 padded to 64 x 512: {1e3 * big_s:.2f} ms, of which the transforms "
        f"{1e3 * big_fft_s:.2f} ms ({big_fft_s / big_s:.0%}); at 10 Hz {10 * big_s:.1%} of a core "
        f"(under 10 %: {_yes(10 * big_s < 0.1)})",
    ]


def _transforms(chain: RadarChain, cube: np.ndarray) -> np.ndarray:
    """The two transforms alone, as the chain calls them."""
    settings, params = chain.settings, chain.params
    ranges = fft.range_fft(cube, params.samples * settings.range_padding)
    return fft.doppler_fft(ranges, params.chirps * settings.doppler_padding)


def _best(run: Callable[[], object], runs: int = 200) -> float:
    run()
    best_s = float("inf")
    for _ in range(runs):
        start_s = time.thread_time()
        run()
        best_s = min(best_s, time.thread_time() - start_s)
    return best_s


def _yes(good: bool) -> str:
    return "yes" if good else "NO"


if __name__ == "__main__":
    main()
