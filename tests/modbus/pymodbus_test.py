#!/usr/bin/python3
"""pymodbus_test.py MODBUS_TOOL [VALUES [SEED]] : our codec and client against python3-pymodbus.

A pymodbus server holds the registers. Random numbers of all types in all word and byte orders are put
there by pymodbus and read by us (functions 3, 4 and 23), and written by us (functions 6, 16 and 23) and
decoded by pymodbus.
"""
import math
import random
import socket
import struct
import subprocess
import sys
import threading
import time
import warnings

warnings.simplefilter("ignore")
try:
    from pymodbus.constants import Endian
    from pymodbus.datastore import ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext
    from pymodbus.payload import BinaryPayloadBuilder, BinaryPayloadDecoder
    from pymodbus.server import StartTcpServer
except ImportError as missing:
    print(f"pymodbus_test: {missing}: apt-get install python3-pymodbus python3-serial-asyncio")
    sys.exit(125)

BIG = getattr(Endian, "BIG", None) or Endian.Big
LITTLE = getattr(Endian, "LITTLE", None) or Endian.Little
SUFFIX = {"int16": "16bit_int", "uint16": "16bit_uint", "int32": "32bit_int", "uint32": "32bit_uint",
          "float32": "32bit_float", "float64": "64bit_float"}
WORDS = {"int16": 1, "uint16": 1, "int32": 2, "uint32": 2, "float32": 2, "float64": 4}


def endian(order):
    return BIG if order == "high_first" else LITTLE


def orders_for_pymodbus(words, swapped_bytes):
    """pymodbus packs a number word by word, each word in `byteorder`, the words in `wordorder`."""
    return {"byteorder": endian(swapped_bytes), "wordorder": endian(words)}


def random_value(rng, kind):
    if kind == "float32":
        return struct.unpack("f", struct.pack("f", rng.uniform(-1, 1) * 10 ** rng.randint(-6, 6)))[0]
    if kind == "float64":
        return rng.uniform(-1, 1) * 10 ** rng.randint(-12, 12)
    bits = 16 * WORDS[kind]
    return rng.randrange(-(1 << (bits - 1)), 1 << (bits - 1)) if kind[0] == "i" else rng.randrange(1 << bits)


def main():
    tool = sys.argv[1]
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 6000
    rng = random.Random(int(sys.argv[3]) if len(sys.argv) > 3 else 1)
    holding = ModbusSequentialDataBlock(0, [0] * 65536)
    inputs = ModbusSequentialDataBlock(0, [0] * 65536)
    store = ModbusServerContext(slaves=ModbusSlaveContext(hr=holding, ir=inputs, zero_mode=True), single=True)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    threading.Thread(target=StartTcpServer, kwargs={"context": store, "address": ("127.0.0.1", port)},
                     daemon=True).start()
    for _ in range(500):
        try:
            socket.create_connection(("127.0.0.1", port)).close()
            break
        except OSError:
            time.sleep(0.01)

    questions, cases, address = [], [], 0
    for _ in range(count):
        kind = rng.choice(list(WORDS))
        words, swapped = rng.choice(["high_first", "low_first"]), rng.choice(["high_first", "low_first"])
        value = random_value(rng, kind)
        if rng.random() < 0.5:
            function = rng.choice([3, 4, 23])
            builder = BinaryPayloadBuilder(**orders_for_pymodbus(words, swapped))
            getattr(builder, "add_" + SUFFIX[kind])(value)
            registers = [struct.unpack(">H", bytes(word))[0] for word in builder.build()]
            (inputs if function == 4 else holding).setValues(address, registers)
            questions.append(f"read {function} {address} {kind} {words} {swapped}")
        else:
            function = rng.choice([6, 16, 23] if WORDS[kind] == 1 else [16, 23])
            questions.append(f"write {function} {address} {kind} {words} {swapped} {value!r}")
        cases.append((questions[-1], kind, words, swapped, address, value))
        address += WORDS[kind]
    assert address < 65000

    output = subprocess.run([tool, str(port)], input="\n".join(questions) + "\n", text=True,
                            stdout=subprocess.PIPE, check=True, timeout=300).stdout.split("\n")
    wrong = 0
    for (question, kind, words, swapped, where, value), ours in zip(cases, output):
        theirs = value
        if question.startswith("write"):
            registers = holding.getValues(where, WORDS[kind])
            decoder = BinaryPayloadDecoder.fromRegisters(registers, **orders_for_pymodbus(words, swapped))
            theirs = getattr(decoder, "decode_" + SUFFIX[kind])()
        same = not ours.startswith("failed") and float(ours) == theirs == value and not math.isnan(theirs)
        if not same:
            wrong += 1
            if wrong <= 10:
                print(f"{question}\n  value    {value!r}\n  pymodbus {theirs!r}\n  sinerig  {ours}")
    print(f"{len(cases)} random numbers, {wrong} differ")
    sys.exit(1 if wrong or len(output) <= len(cases) - 1 else 0)


if __name__ == "__main__":
    main()
