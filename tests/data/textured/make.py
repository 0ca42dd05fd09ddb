"""Makes the textured test room: images, room.obj with room.mtl, and room.glb with the same room.

    python3 make.py        # needs Pillow and NumPy; writes beside itself
"""
import io
import json
import struct

import numpy as np
from PIL import Image


def grid(n, m):
    return np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(m) + 0.5) / m)


def boards(n=48):
    x, y = grid(n, n)
    board = np.floor(4 * x)
    grain = 0.5 + 0.5 * np.sin(23 * y + 5 * np.sin(3 * board) + 9 * np.sin(6 * x))
    dark = np.where((4 * x) % 1 < 0.12, 0.35, 1.0)
    tone = (0.55 + 0.25 * np.sin(7 * board) * 0.6 + 0.2 * grain) * dark
    return np.stack([tone * 0.9, tone * 0.62, tone * 0.38], -1)


def bricks(n=48):
    x, y = grid(n, n)
    row = np.floor(6 * y)
    joint = ((6 * y) % 1 < 0.15) | ((3 * x + 0.5 * (row % 2)) % 1 < 0.08)
    tone = 0.7 + 0.3 * np.sin(12.9 * row + 31 * np.floor(3 * x + 0.5 * (row % 2)))
    brick = np.stack([0.75 * tone, 0.35 * tone, 0.3 * tone], -1)
    return np.where(joint[..., None], 0.85, brick)


def poster(n=16):
    x, y = grid(n, n)
    disc = (x - 0.5) ** 2 + (y - 0.4) ** 2 < 0.09
    field = np.stack([0.2 + 0 * x, 0.4 + 0.4 * y, 0.8 + 0 * x], -1)
    return np.where(disc[..., None], [0.95, 0.85, 0.3], field)


def checker(n=8):
    x, y = np.meshgrid(np.arange(n), np.arange(n))
    return np.where(((x + y) % 2)[..., None], 0.9, [0.15, 0.2, 0.35])


def leaf(n=32):
    x, y = grid(n, n)
    inside = np.abs(x - 0.5) < 0.42 * np.sin(np.pi * y) * (0.75 + 0.25 * np.cos(20 * y))
    colour = np.stack([0.25 + 0.2 * x, 0.65 - 0.2 * y, 0.2 + 0 * x], -1)
    return np.concatenate([colour, np.where(inside, 1.0, 0.0)[..., None]], -1)


def screen(n=32, m=18):
    x, y = grid(n, m)
    bars = np.stack([(x * 3 < 1), (np.abs(x * 3 - 1.5) < 0.5), (x * 3 > 2)], -1) * 0.9
    return np.where((y > 0.7)[..., None], 0.15, bars + 0.05)


def codes(picture):
    return (np.clip(picture, 0, 1) * 255 + 0.5).astype(np.uint8)


# Name, picture, what of the material it is.
IMAGES = {"floor.png": boards(), "wall.png": bricks(), "poster.tga": poster(), "checker.png": checker(),
          "leaf.png": leaf(), "screen.png": screen()}

# Material: Kd, Ke, image, options.
MATERIALS = {
    "plain": ([0.7, 0.68, 0.65], None, None),
    "floor": ([0.9, 0.9, 0.9], None, "floor.png"),
    "wall": ([1, 1, 1], None, "wall.png"),
    "poster": ([0.9, 0.9, 0.9], None, "poster.tga"),
    "box": ([0.8, 0.8, 0.8], None, "checker.png"),
    "leaf": ([1, 1, 1], None, "leaf.png"),
    "screen": ([0.05, 0.05, 0.05], [2, 2, 2], "screen.png"),
    "lamp": ([0, 0, 0], [6, 5.5, 5], None),
}

SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]


def quad(corners, material, scale=(1, 1)):
    return [(p, (u * scale[0], v * scale[1])) for p, (u, v) in zip(corners, SQUARE)], material


def box(low, high, material):
    (a, b, c), (x, y, z) = low, high
    sides = [[(a, b, z), (x, b, z), (x, y, z), (a, y, z)], [(x, b, c), (a, b, c), (a, y, c), (x, y, c)],
             [(x, b, z), (x, b, c), (x, y, c), (x, y, z)], [(a, b, c), (a, b, z), (a, y, z), (a, y, c)],
             [(a, y, z), (x, y, z), (x, y, c), (a, y, c)]]
    return [quad(side, material) for side in sides]


X, Y, Z = 2.0, 2.4, 2.0
FACES = [
    quad([(-X, 0, Z), (X, 0, Z), (X, 0, -Z), (-X, 0, -Z)], "floor", (3, 2.5)),
    quad([(-X, Y, -Z), (X, Y, -Z), (X, Y, Z), (-X, Y, Z)], "plain"),
    quad([(-X, 0, -Z), (X, 0, -Z), (X, Y, -Z), (-X, Y, -Z)], "wall", (2, 1.25)),
    quad([(X, 0, Z), (-X, 0, Z), (-X, Y, Z), (X, Y, Z)], "plain"),
    quad([(-X, 0, Z), (-X, 0, -Z), (-X, Y, -Z), (-X, Y, Z)], "poster"),
    quad([(X, 0, -Z), (X, 0, Z), (X, Y, Z), (X, Y, -Z)], "plain"),
    quad([(-0.6, Y - 0.02, -0.4), (0.6, Y - 0.02, -0.4), (0.6, Y - 0.02, 0.4), (-0.6, Y - 0.02, 0.4)], "lamp"),
    *box((0.3, 0.0, -1.2), (1.1, 0.9, -0.5), "box"),
    quad([(-1.2, 0.1, -0.6), (-0.3, 0.1, -1.0), (-0.3, 1.3, -1.0), (-1.2, 1.3, -0.6)], "leaf"),
    quad([(1.95, 1.0, -1.3), (1.95, 1.0, -0.3), (1.95, 1.6, -0.3), (1.95, 1.6, -1.3)], "screen"),
]


def encoded(name):
    image = Image.fromarray(codes(IMAGES[name]))
    out = io.BytesIO()
    image.save(out, format="TGA" if name.endswith("tga") else "PNG", **({} if name.endswith("tga") else {"optimize": True}))
    return out.getvalue()


def obj():
    lines, count = ["mtllib room.mtl"], 0
    for corners, material in FACES:
        lines.append(f"usemtl {material}")
        for p, uv in corners:
            lines += ["v %g %g %g" % p, "vt %g %g" % uv]
        numbers = range(count + 1, count + 5)
        lines.append("f " + " ".join(f"{k}/{k}" for k in numbers))
        count += 4
    return "\n".join(lines) + "\n"


def mtl():
    lines = []
    for name, (kd, ke, image) in MATERIALS.items():
        lines += [f"newmtl {name}", "Kd %g %g %g" % tuple(kd)]
        if ke:
            lines.append("Ke %g %g %g" % tuple(ke))
        if name == "screen":
            lines.append(f"map_Ke {image}")
        elif name == "poster":
            lines.append(f"map_Kd -clamp on -s 2 2 1 -o -0.5 -0.6 0 {image}")
        elif image:
            lines.append(f"map_Kd {image}")
        if name == "leaf":
            lines.append(f"map_d {image}")
    return "\n".join(lines) + "\n"


def glb():
    binary, views = b"", []

    def view(data):
        nonlocal binary
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        binary += data + b"\0" * (-len(data) % 4)
        return len(views) - 1

    accessors, primitives, names = [], [], list(MATERIALS)

    def accessor(data, kind, floats):
        entry = {"bufferView": view(data.tobytes()), "componentType": 5126 if floats else 5123, "count": len(data), "type": kind}
        if kind == "VEC3":
            entry |= {"min": data.min(0).tolist(), "max": data.max(0).tolist()}
        accessors.append(entry)
        return len(accessors) - 1

    for name in names:
        own = [corners for corners, material in FACES if material == name]
        points = np.array([p for corners in own for p, _ in corners], np.float32)
        # glTF's v runs down.
        places = np.array([(u, 1 - v) for corners in own for _, (u, v) in corners], np.float32)
        indices = np.array([4 * k + i for k in range(len(own)) for i in (0, 1, 2, 0, 2, 3)], np.uint16)
        primitives.append({"attributes": {"POSITION": accessor(points, "VEC3", True), "TEXCOORD_0": accessor(places, "VEC2", True)},
                           "indices": accessor(indices, "SCALAR", False), "material": names.index(name)})
    images = [name for name in IMAGES]
    # TGA is none of glTF's formats.
    def png(name):
        out = io.BytesIO()
        Image.fromarray(codes(IMAGES[name])).save(out, format="PNG", optimize=True)
        return out.getvalue()
    image_entries = [{"bufferView": view(png(name)), "mimeType": "image/png"} for name in images]
    materials = []
    for name, (kd, ke, image) in MATERIALS.items():
        own = {"name": name, "doubleSided": name == "leaf", "pbrMetallicRoughness": {"baseColorFactor": [*kd, 1], "metallicFactor": 0}}
        info = {"index": images.index(image)} if image else None
        if name == "poster":
            # u' = 2 u - 0.5; v' = 2 v - 0.6 upwards is 2 v + 1 - 2 + 0.6 downwards.
            info["extensions"] = {"KHR_texture_transform": {"scale": [2, 2], "offset": [-0.5, -0.4]}}
        if name == "screen":
            own["emissiveTexture"] = info
        elif info:
            own["pbrMetallicRoughness"]["baseColorTexture"] = info
        if name == "leaf":
            own["alphaMode"] = "BLEND"
        if ke:
            strength = max(ke)
            own["emissiveFactor"] = [k / strength for k in ke]
            own["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": strength}}
        materials.append(own)
    root = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "name": "room"}],
            "meshes": [{"primitives": primitives}], "materials": materials, "accessors": accessors, "bufferViews": views,
            "buffers": [{"byteLength": len(binary)}], "images": image_entries,
            "samplers": [{"wrapS": 33071, "wrapT": 33071}],
            "textures": [{"source": k} | ({"sampler": 0} if name.endswith("tga") else {}) for k, name in enumerate(images)],
            "extensionsUsed": ["KHR_materials_emissive_strength", "KHR_texture_transform"]}
    text = json.dumps(root, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


CAMERA = """mode = "global"
[camera]
position = [-0.3, 1.3, 1.9]
target = [0.1, 1.0, -1.0]
vertical_fov = 60
"""

if __name__ == "__main__":
    for name in IMAGES:
        open(name, "wb").write(encoded(name))
    open("room.obj", "w").write(obj())
    open("room.mtl", "w").write(mtl())
    open("room.glb", "wb").write(glb())
    open("room.toml", "w").write('obj = "room.obj"\n' + CAMERA + "[materials.leaf]\ntwo_sided = true\n")
    open("room-glb.toml", "w").write('mesh = "room.glb"\n' + CAMERA)
