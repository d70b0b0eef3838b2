"""Checks a picture of all layers as OpenImageIO reads it.

usage: layers.py PICTURE.exr
"""
import json, sys
import numpy, OpenImageIO

picture = OpenImageIO.ImageInput.open(sys.argv[1])
spec, pixels = picture.spec(), picture.read_image("float").astype(numpy.float64)
names = list(spec.channelnames)
facts = {a.name: a.value for a in spec.extra_attribs}


def color(layer):
    return numpy.stack([pixels[..., names.index(layer + c)] for c in "RGB"], -1)


def column(name):
    return pixels[..., names.index(name)]


def murmur3(data):
    """MurmurHash3_x86_32 of bytes, seed 0."""
    mask, hashed = 0xFFFFFFFF, 0
    turn = lambda x, n: (x << n | x >> 32 - n) & mask
    mix = lambda k: turn(k * 0xCC9E2D51 & mask, 15) * 0x1B873593 & mask
    whole = len(data) // 4 * 4
    for i in range(0, whole, 4):
        hashed = turn(hashed ^ mix(int.from_bytes(data[i : i + 4], "little")), 13) * 5 + 0xE6546B64 & mask
    hashed ^= mix(int.from_bytes(data[whole:], "little")) ^ len(data)
    for shift, factor in [(16, 0x85EBCA6B), (13, 0xC2B2AE35), (16, 1)]:
        hashed = (hashed ^ hashed >> shift) * factor & mask
    return hashed


for name, text in facts.items():
    if name.endswith("/name"):
        assert name == f"cryptomatte/{murmur3(text.encode()):08x}"[:19] + "/name", name
    if name.endswith("/manifest"):
        for of, digits in json.loads(text).items():
            found = murmur3(of.encode())
            if found >> 23 & 255 in (0, 255):
                found ^= 1 << 23
            assert f"{found:08x}" == digits, (of, digits)

beauty = color("")
ways = ["diffuse_direct", "diffuse_indirect", "specular_direct", "specular_indirect", "emission", "environment"]
groups = sorted({name.rsplit(".", 1)[0] for name in names if name.startswith("light_")})
for layers in [ways] + [groups] * bool(groups):
    apart = numpy.abs(sum(color(layer + ".") for layer in layers) - beauty) / (beauty + 1e-3)
    assert apart.max() < 2e-6, (layers, apart.max())

for name, kind in [("R", "float"), ("Z", "float"), ("instance_id.lo", "uint"), ("samples", "uint"), ("CryptoObject00.R", "float")]:
    found = str(spec.channelformats[names.index(name)]) if spec.channelformats else str(spec.format)
    assert found.startswith(kind), (name, found)
assert facts["compression"] == "zip"
for name in ["software", "softwareVersion", "commit", "seed", "samplesPerPixel", "renderTimeSeconds", "rays", "noise", "worldToCamera", "worldToNDC"]:
    assert name in facts, name

# The matrices take the points that pixels show to these pixels, and to their depth.
position = numpy.stack([column("position." + c) for c in "XYZ"] + [numpy.ones(beauty.shape[:2])], -1)
seen = numpy.isfinite(column("Z")) & (numpy.abs(column("Z")) < 1e4)
ndc = position @ numpy.array(facts["worldToNDC"], float).reshape(4, 4)
height, width = beauty.shape[:2]
y, x = numpy.mgrid[0:height, 0:width] + 0.5
for found, pixel in [(ndc[..., 0] / ndc[..., 3] * width, x), (ndc[..., 1] / ndc[..., 3] * height, y)]:
    assert numpy.abs(found - pixel)[seen].max() < 0.01
camera = position @ numpy.array(facts["worldToCamera"], float).reshape(4, 4)
assert (numpy.abs(camera[..., 2] - column("Z"))[seen] <= 1e-4 * (1 + column("Z")[seen])).all()
assert (numpy.abs(numpy.linalg.norm(camera[..., :3], axis=-1) - column("distance"))[seen] <= 1e-4 * (1 + column("distance")[seen])).all()
turned = numpy.array(facts["worldToCamera"], float).reshape(4, 4)[:3, :3] * [1, 1, -1]
normals = [numpy.stack([column(n + c) for c in "XYZ"], -1) for n in ["normal.", "camera_normal."]]
assert numpy.abs(normals[0] @ turned - normals[1])[seen].max() < 1e-5
print(f"{sys.argv[1].rsplit('/', 1)[-1]}: {len(names)} channels, {len(groups)} groups, all right")
