#!/usr/bin/python3
"""compare_disturbed.py REFERENCE.csv OTHER.csv --lost LEAST MOST [--delay LEAST MOST] [--rounding R]

Every point of OTHER must differ from REFERENCE by less than its own 95 % interval, in gain and in phase,
and must say which part of its samples was lost: between LEAST and MOST. The intervals are widened so that
they hold all figures together in 95 % of cases, for 20 degrees of freedom, by Bonferroni's rule. With --delay
the one that fits OTHER best, by weighted least squares on the phases, is taken out first; it must lie between
LEAST and MOST seconds. What an interval cannot know is allowed on top, R dB and degrees, 1e-8 unless told: what
the end of a transient leaves, and the rounding of numbers that repeats in every cycle.
"""
import argparse
import csv
import sys

parser = argparse.ArgumentParser()
parser.add_argument("reference")
parser.add_argument("other")
parser.add_argument("--lost", type=float, nargs=2, required=True)
parser.add_argument("--delay", type=float, nargs=2)
parser.add_argument("--rounding", type=float, default=1e-8)
options = parser.parse_args()


def points(path):
    with open(path) as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


reference, other = points(options.reference), points(options.other)
if len(reference) != len(other) or not reference:
    sys.exit(f"FAILED: {len(reference)} points against {len(other)}")
widened = {8: 3.02 / 2.09}[2 * len(reference)]  # quantiles of Student's t: 1 - 0.025 / 8 over 0.975
failed = 0
delay_s = 0.0
if options.delay:
    weighted = sum_of_weights = 0.0
    for expected, got in zip(reference, other):
        deg_per_s = 360.0 * float(got["freq_hz"])
        weight = (deg_per_s / float(got["phase_interval_deg"])) ** 2
        weighted += weight * (float(expected["phase_deg"]) - float(got["phase_deg"])) / deg_per_s
        sum_of_weights += weight
    delay_s = weighted / sum_of_weights
    print(f"delay {1e3 * delay_s:.4f} ms")
    failed += not options.delay[0] <= delay_s <= options.delay[1]
for expected, got in zip(reference, other):
    gain_db = abs(float(got["gain_db"]) - float(expected["gain_db"]))
    phase_deg = abs(float(got["phase_deg"]) + 360.0 * float(got["freq_hz"]) * delay_s
                    - float(expected["phase_deg"]))
    gain_limit_db = max(options.rounding, widened * float(got["gain_interval_db"]))
    phase_limit_deg = max(options.rounding, widened * float(got["phase_interval_deg"]))
    lost = float(got["lost"]) / (float(got["lost"]) + float(got["samples"]))
    fits = (expected["freq_hz"] == got["freq_hz"] and got["status"] == "good"
            and gain_db <= gain_limit_db and phase_deg <= phase_limit_deg
            and options.lost[0] <= lost <= options.lost[1])
    failed += not fits
    print(f"{float(got['freq_hz']):9.4f} Hz  {gain_db:8.1e} of {gain_limit_db:8.1e} dB  "
          f"{phase_deg:8.1e} of {phase_limit_deg:8.1e} deg  lost {100 * lost:5.2f} %  {got['status']}"
          + ("" if fits else "  FAILED"))
sys.exit(1 if failed else 0)
