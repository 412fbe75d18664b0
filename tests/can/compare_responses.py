#!/usr/bin/python3
"""compare_responses.py REFERENCE.csv OTHER.csv (--within RELATIVE | --quantum Q --rate HZ)

Takes out of OTHER the one delay that fits best, the turn-around of the drive, which no stamp of the
host can see and which must be below 0.1 us; then compares point by point, relative to |H|; or, with the step of the other's feedback
signal, in units of the interval that this quantisation alone leaves: rounding to Q is an error of
Q / sqrt(12) rms, of which one coherent cycle of RATE / f samples lets sqrt(2 f / RATE) through to each
part of the Fourier coefficient (further cycles repeat it). Of those, sqrt(-2 ln(0.05 / points)) hold
all points together in 95 % of cases.
"""
import argparse
import cmath
import csv
import math
import sys

parser = argparse.ArgumentParser()
parser.add_argument("reference")
parser.add_argument("other")
parser.add_argument("--within", type=float)
parser.add_argument("--quantum", type=float)
parser.add_argument("--rate", type=float)
options = parser.parse_args()


def points(path):
    with open(path) as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def response(row):
    return complex(float(row["re"]), float(row["im"]))


reference, other = points(options.reference), points(options.other)
if len(reference) != len(other) or not reference:
    sys.exit(f"FAILED: {len(reference)} points against {len(other)}")


def lag(expected, got):
    return -cmath.phase(response(got) / response(expected))


def omega(row):
    return 2 * math.pi * float(row["freq_hz"])


pairs = list(zip(reference, other))
delay_s = 0.0
if options.within:
    delay_s = (sum(omega(got) * lag(expected, got) for expected, got in pairs)
               / sum(omega(got) ** 2 for expected, got in pairs))
    print(f"delay of the drive {delay_s:.2e} s")
    # 20 ns over CAN, five readings of the clock in virtual time; less over Modbus, where it is stamped.
    if not -1e-9 < delay_s < 1e-7:
        sys.exit("FAILED: the delay must be between 0 and 1e-7 s")
worst = 0.0
for expected, got in pairs:
    frequency_hz = float(got["freq_hz"])
    if expected["freq_hz"] != got["freq_hz"] or got["status"] != "good":
        sys.exit(f"FAILED: {got['freq_hz']} Hz is {got['status']}")
    error = abs(response(got) * cmath.exp(1j * omega(got) * delay_s) - response(expected))
    relative = error / abs(response(expected))
    line = f"{frequency_hz:9.4f} Hz  relative {relative:8.1e}"
    size = relative
    if options.quantum:
        sigma = (options.quantum / math.sqrt(12) * math.sqrt(2 * frequency_hz / options.rate)
                 / float(got["input_amplitude"]))
        size = error / (math.sqrt(-2 * math.log(0.05 / len(pairs))) * sigma)
        line += f"  intervals {size:6.3f}"
    worst = max(worst, size)
    print(line)
limit = options.within or 1.0
print(f"worst {worst:.2g}, allowed {limit:g}")
sys.exit(0 if worst <= limit else 1)
