"""Hostile files for hostile_test.py and limits_test.py: small files whose headers claim a large size, forged records, mutated
JSON."""

import json
import struct
import zlib

DEEP = "@deep"
HOSTILE_TEXTS = ["", "=1+2", "+1+2", "@SUM(A1)", "-2+3", "\t=1", "[5cm] x", "[p] x", "*", "\u202egnp.exe", "a\u2066b\u2069", "x" * 200,
                 "é" * 120, "\\input{/etc/passwd}", "<script>alert(1)</script>", "]]>", "a\u0000b", "a\nb", "a\x1b[2Jb", "../../x",
                 "/etc/passwd", "object:1", "|x", "`id`", "$(id)", "%s%n", "\ufeff", "\ufffe", "a,b\"c", "'", "&amp;", "#", "C:\\x"]
HOSTILE_NUMBERS = [0, -0.0, -1, 1, 1e-320, 5e-324, 1e-200, 1e100, 1e101, 1e154, 1e308, -1e308, 2**31, 2**31 - 1, -2**31, 2**53, 2**63,
                   2**64 - 1, 2**64, 10**30, 0.1, 1e-9, 99999999999]


def chunk(kind, body):
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def png(width, height, *, depth=8, colour=0, rows=b"", claimed_bytes=None):
    """Returns a PNG whose header claims this size, whatever its pixels are."""
    header = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)
    data = zlib.compress(rows, 9) if claimed_bytes is None else bytes(claimed_bytes)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def png_of_zeros(width, height):
    """Returns a complete PNG of zeros of 16 bits, which deflate compresses as far as it can."""
    packer = zlib.compressobj(9)
    data = b"".join(packer.compress(bytes(1 + 2 * width)) for _ in range(height)) + packer.flush()
    header = struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def jpeg(width, height, *, progressive=False):
    """Returns a JPEG of gray blocks: the header, tables with one code of one bit, and the first bytes of a scan of zero bits."""
    segment = lambda marker, body: b"\xff" + bytes([marker]) + struct.pack(">H", len(body) + 2) + body
    tables = segment(0xDB, bytes([0]) + bytes([1] * 64))
    frame = segment(0xC2 if progressive else 0xC0, struct.pack(">BHHB", 8, height, width, 1) + bytes([1, 0x11, 0]))
    codes = b"".join(segment(0xC4, bytes([kind, 1] + [0] * 15 + [0])) for kind in (0x00, 0x10))
    scan = segment(0xDA, bytes([1, 1, 0, 0, 0 if progressive else 63, 0]))
    return b"\xff\xd8" + tables + frame + codes + scan + bytes(16) + b"\xff\xd9"


def progressive_jpeg(width, height, scans):
    """Returns a progressive JPEG of one DC scan and `scans` scans of the same coefficients: each costs a pass over the image."""
    segment = lambda marker, body: b"\xff" + bytes([marker]) + struct.pack(">H", len(body) + 2) + body
    tables = segment(0xDB, bytes([0]) + bytes([1] * 64))
    frame = segment(0xC2, struct.pack(">BHHB", 8, height, width, 1) + bytes([1, 0x11, 0]))
    dc = segment(0xC4, bytes([0x00, 1] + [0] * 15 + [0]))
    ac = segment(0xC4, bytes([0x10, 1] + [0] * 15 + [0xE0]))  # end of 16384 blocks and more
    n_blocks = ((width + 7) // 8) * ((height + 7) // 8)
    first = segment(0xDA, bytes([1, 1, 0x00, 0, 0, 0])) + bytes(n_blocks // 8 + 1)
    more = segment(0xC4, bytes([0x10, 1] + [0] * 15 + [0x00])) + segment(0xDA, bytes([1, 1, 0x00, 1, 63, 0])) + bytes(n_blocks // 8 + 1)
    return b"\xff\xd8" + tables + frame + dc + ac + first + more * scans + b"\xff\xd9"


def flo(width, height, n_bytes=16):
    return b"PIEH" + struct.pack("<ii", width, height) + bytes(n_bytes)


def mask_text(first_row, rows):
    """Returns a mask that claims first_row x rows labels in about 2 (first_row + rows) bytes."""
    return b"0 " * first_row + b"\n" + b"0\n" * rows


def mcap_record(op, body):
    return struct.pack("<BQ", op, len(body)) + body


def mcap_text(text):
    return struct.pack("<I", len(text)) + text


def mcap_chunk(records, size, compression):
    return mcap_record(6, struct.pack("<QQQI", 0, 0, size, 0) + mcap_text(compression) + struct.pack("<Q", len(records)) + records)


def mcap(*records):
    return b"\x89MCAP0\r\n" + b"".join(records) + mcap_record(15, struct.pack("<I", 0))


def bag_record(fields, data=b""):
    header = b"".join(struct.pack("<I", len(k) + 1 + len(v)) + k + b"=" + v for k, v in fields.items())
    return struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data


def bag_chunk(data, size, compression):
    return bag_record({b"op": b"\x05", b"compression": compression, b"size": struct.pack("<I", size)}, data)


def bag(*records):
    return b"#ROSBAG V2.0\n" + b"".join(records)


def tum_line(i, *, step=0.1):
    return f"{i * step:.1f} {i * 0.01:.2f} {(i % 100) * 0.1:.1f} 0 0 0 0 1\n"


# ---- records


def record(**changes):
    base = {"schema": 1, "dataset": "synthetic", "sequence": "s18", "estimator": "joint_flow", "noise": "none", "level": 0.0, "seed": 0,
            "frame": 1, "body": "ego", "status": "ok", "n_points": 100, "n_inliers": 90,
            "errors": {"ER_deg": 0.01, "Et_m": 0.02}, "values": {"nees": 5.0, "step_gt_m": 0.6}, "bound": {"ER_deg": 0.01, "Et_m": 0.01},
            "time_ms": {"refine": 0.3, "start": 0.1, "total": 0.5}}
    return {**base, **changes}


def record_line(content):
    return json.dumps(content, ensure_ascii=False, separators=(",", ":"))


def nodes(tree, path=()):
    """Yields the path of every value below the root of a JSON tree."""
    items = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in items:
        yield (*path, key)
        yield from nodes(value, (*path, key))


def replaced(tree, path, value):
    copy = json.loads(json.dumps(tree))
    at = copy
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = value
    return copy


def hostile_value(dice):
    return dice.choice([lambda: dice.choice(HOSTILE_TEXTS), lambda: dice.choice(HOSTILE_NUMBERS), lambda: None, lambda: True, lambda: [],
                        lambda: {}, lambda: [[]] * 3, lambda: {"a": {"b": []}}, lambda: [dice.choice(HOSTILE_NUMBERS)] * 4, lambda: DEEP])()


def mutated_json(tree, dice):
    """Returns the bytes of a JSON tree in which one value is hostile, or whose text is damaged."""
    paths = list(nodes(tree))
    way = dice.randrange(8)
    if way < 5 or not paths:
        text = json.dumps(replaced(tree, dice.choice(paths), hostile_value(dice)) if paths else hostile_value(dice))
    elif way == 5:  # a key twice, or an unknown one
        text = json.dumps(tree).replace("{", '{"%s": 1, ' % dice.choice(["name", "sources", "schema", "unknown", "\\ud800", "noise"]), 1)
    elif way == 6:  # bytes
        data = bytearray(json.dumps(tree, indent=1).encode())
        for _ in range(dice.randrange(1, 6)):
            data[dice.randrange(len(data))] = dice.randrange(256)
        return bytes(data)
    else:
        text = json.dumps(tree)
        text = text[:dice.randrange(len(text))]
    return text.replace(json.dumps(DEEP), "[" * 3000 + "]" * 3000).encode()
