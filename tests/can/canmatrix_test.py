#!/usr/bin/python3
"""canmatrix_test.py CODEC_TOOL [MESSAGES [SEED]] : our DBC reader and codec against python3-canmatrix.

Random messages of non-overlapping signals (Intel and Motorola, signed, unsigned, float32, float64,
classic and extended identifiers, 1 to 64 bytes) are written as DBC text. Both programs read that text
and must agree on every decoded value and every encoded payload.
"""
import io
import logging
import math
import random
import struct
import subprocess
import sys
import tempfile

logging.disable(logging.CRITICAL)
try:
    import canmatrix.formats
except ImportError:
    print("canmatrix_test: python3-canmatrix is not installed (apt-get install python3-canmatrix)")
    sys.exit(125)


def bits_of(start, length, motorola):
    """The positions a signal covers, by walking the sawtooth one bit at a time."""
    position, covered = start, []
    for _ in range(length):
        covered.append(position)
        if not motorola:
            position += 1
        elif position % 8:
            position -= 1
        else:
            position += 15
    return covered


def random_message(rng, number):
    size = rng.choice([1, 2, 3, 4, 5, 6, 7, 8, 8, 8, 8, 8, 12, 16, 24, 64])
    free, signals, types = set(range(size * 8)), [], []
    for index in range(40):
        kind = rng.choice(["u", "u", "s", "s", "f32", "f64"])
        length = {"f32": 32, "f64": 64}.get(kind) or rng.randint(1, min(64, size * 8))
        motorola = rng.random() < 0.5
        start = rng.randrange(size * 8)
        covered = bits_of(start, length, motorola)
        if not set(covered) <= free:
            continue
        free -= set(covered)
        scale = rng.choice([1, 0.5, 0.001, 25 / 65535, -0.125])
        offset = rng.choice([0, 0, -12.5, 100])
        if kind in ("f32", "f64"):
            scale, offset = 1, 0
        sign = "-" if kind in ("s", "f32", "f64") else "+"
        signals.append((f"S{index}", kind, start, length, scale, offset))
        types.append(f' SG_ S{index} : {start}|{length}@{0 if motorola else 1}{sign} '
                     f'({scale!r},{offset!r}) [0|0] "" Host')
    identifier = number if number < 2048 else 0x80000000 + number
    return identifier, f"M{number}", size, signals, types


def main():
    tool = sys.argv[1]
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 3000
    rng = random.Random(int(sys.argv[3]) if len(sys.argv) > 3 else 1)
    messages = [random_message(rng, 1 + 5 * n) for n in range(count)]

    text = ['VERSION ""', "NS_ :", "BS_:", "BU_: Host Drive"]
    value_types = []
    for identifier, name, size, signals, lines in messages:
        text += [f"BO_ {identifier} {name}: {size} Drive", *lines, ""]
        for signal, kind, *_ in signals:
            if kind in ("f32", "f64"):
                value_types.append(f"SIG_VALTYPE_ {identifier} {signal} : {1 if kind == 'f32' else 2};")
    text = "\n".join(text + value_types) + "\n"
    matrix = next(iter(canmatrix.formats.load(io.BytesIO(text.encode()), "dbc").values()))

    questions, answers = [], []
    for identifier, name, size, signals, _ in messages:
        frame = matrix.frame_by_name(name)
        payload = bytes(rng.randrange(256) for _ in range(size))
        decoded = frame.decode(payload)
        for signal, *_ in signals:
            questions.append(f"decode {name} {signal} {payload.hex()}")
            answers.append(("value", float(decoded[signal].phys_value)))
        for signal, kind, start, length, scale, offset in signals:
            if kind == "f32":
                raw = value = struct.unpack("f", struct.pack("f", rng.uniform(-1e3, 1e3)))[0]
            elif kind == "f64":
                raw = value = rng.uniform(-1e3, 1e3)
            else:
                # Codes below 2**50, so that value and offset fit into a double.
                width = min(length, 50)
                low = -(1 << (width - 1)) if kind == "s" else 0
                high = (1 << (width - 1)) - 1 if kind == "s" else (1 << width) - 1
                raw = rng.randint(low, high)
                value = raw * scale + offset
            questions.append(f"encode {name} {signal} {'00' * size} {value!r}")
            answers.append(("bytes", frame.encode({signal: raw})))

    with tempfile.NamedTemporaryFile("w", suffix=".dbc") as file:
        file.write(text)
        file.flush()
        output = subprocess.run([tool, file.name], input="\n".join(questions) + "\n", text=True,
                                stdout=subprocess.PIPE, check=True).stdout.split("\n")
    wrong = compared = 0
    for question, answer, ours in zip(questions, answers, output):
        compared += 1
        if answer[0] == "value":
            same = (math.isnan(answer[1]) and math.isnan(float(ours))
                    or math.isclose(answer[1], float(ours), rel_tol=1e-14, abs_tol=1e-12))
        else:
            same = answer[1].hex() == ours
        if not same:
            wrong += 1
            if wrong <= 10:
                theirs = answer[1] if answer[0] == "value" else answer[1].hex()
                print(f"{question}\n  canmatrix {theirs}\n  sinerig   {ours}")
    signals = sum(len(message[3]) for message in messages)
    print(f"{signals} random signals in {len(messages)} messages, {compared} comparisons, {wrong} differ")
    sys.exit(1 if wrong or signals < 3 * count else 0)


if __name__ == "__main__":
    main()
