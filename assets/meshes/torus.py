"""Writes torus.glb, the mesh of the preset `torus`: a ring around the y axis, with seams in its texture.

Run: python3 torus.py [FILE]   (Python alone)
"""

import json
import math
import struct
import sys

ROUND, TUBE = 168, 72  # quads around the axis and around the tube
RADIUS, THIN = 1.0, 0.36  # metres


def main(path):
    positions, uvs, triangles = [], [], []
    for j in range(TUBE + 1):
        for i in range(ROUND + 1):
            # The vertices on both sides of a seam are the same to the bit.
            a, b = 2 * math.pi * (i % ROUND) / ROUND, 2 * math.pi * (j % TUBE) / TUBE
            r = RADIUS + THIN * math.cos(b)
            positions.append((r * math.cos(a), THIN * math.sin(b), r * math.sin(a)))
            uvs.append((i / ROUND, j / TUBE))
    for j in range(TUBE):
        for i in range(ROUND):
            a, b = j * (ROUND + 1) + i, (j + 1) * (ROUND + 1) + i
            triangles += [(a, b, b + 1), (a, b + 1, a + 1)]
    parts = [
        b"".join(struct.pack("<3f", *p) for p in positions),
        b"".join(struct.pack("<2f", *uv) for uv in uvs),
        b"".join(struct.pack("<3H", *t) for t in triangles),
    ]
    views, offset = [], 0
    for part in parts:
        views.append({"buffer": 0, "byteOffset": offset, "byteLength": len(part)})
        offset += len(part)
    low, high = ([f(p[k] for p in positions) for k in range(3)] for f in (min, max))
    float32, uint16 = 5126, 5123
    document = {
        "asset": {"version": "2.0", "generator": "torus.py"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "torus", "mesh": 0}],
        "meshes": [
            {
                "name": "torus",
                "primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}],
            }
        ],
        "materials": [
            {
                "name": "Skin",
                "pbrMetallicRoughness": {
                    "baseColorFactor": [0.05, 0.028, 0.015, 1],
                    "metallicFactor": 0,
                    "roughnessFactor": 1,
                },
            }
        ],
        "accessors": [
            {"bufferView": 0, "componentType": float32, "count": len(positions), "type": "VEC3", "min": low, "max": high},
            {"bufferView": 1, "componentType": float32, "count": len(uvs), "type": "VEC2"},
            {"bufferView": 2, "componentType": uint16, "count": 3 * len(triangles), "type": "SCALAR"},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": offset}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    data = b"".join(parts)
    data += b"\0" * (-len(data) % 4)
    with open(path, "wb") as file:
        file.write(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(data)))
        file.write(struct.pack("<II", len(text), 0x4E4F534A) + text)
        file.write(struct.pack("<II", len(data), 0x004E4942) + data)


main(sys.argv[1] if len(sys.argv) > 1 else "torus.glb")
