"""Writes a .glb of triangles. The scripts beside it import it; Python alone."""

import json
import struct


def write(path, name, parts):
    """Writes a mesh called `name`. Each part is its material's name and look (glTF's pbrMetallicRoughness),
    points, texture coordinates, triangles by the numbers of their points, and perhaps a table of
    further attributes, of three numbers a point."""
    blob, views, accessors, primitives, materials = b"", [], [], [], []

    def accessor(code, rows, kind, component, **more):
        nonlocal blob
        data = b"".join(struct.pack(code, *row) for row in rows)
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": len(data)})
        blob += data + b"\0" * (-len(data) % 4)
        count = len(rows) * (3 if kind == "SCALAR" else 1)
        own = {"bufferView": len(views) - 1, "componentType": component, "count": count, "type": kind}
        accessors.append(own | more)
        return len(accessors) - 1

    for material, (label, look, points, uvs, triangles, *more) in enumerate(parts):
        stored = [struct.unpack("<3f", struct.pack("<3f", *p)) for p in points]
        low, high = ([f(p[k] for p in stored) for k in range(3)] for f in (min, max))
        attributes = {
            "POSITION": accessor("<3f", points, "VEC3", 5126, min=low, max=high),
            "TEXCOORD_0": accessor("<2f", uvs, "VEC2", 5126),
        }
        for own, rows in (more[0] if more else {}).items():
            attributes[own] = accessor("<3f", rows, "VEC3", 5126)
        indices = accessor("<3H", triangles, "SCALAR", 5123)
        primitives.append({"attributes": attributes, "indices": indices, "material": material})
        materials.append({"name": label, "pbrMetallicRoughness": look})
    document = {
        "asset": {"version": "2.0", "generator": f"{name}.py"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": name, "mesh": 0}],
        "meshes": [{"name": name, "primitives": primitives}],
        "materials": materials,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(blob)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<2I", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<2I", len(blob), 0x004E4942) + blob
    with open(path, "wb") as file:
        file.write(struct.pack("<3I", 0x46546C67, 2, 12 + len(chunks)) + chunks)
