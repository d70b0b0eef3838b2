"""Decodes a Cryptomatte by its specification (1.2.0), and compares it with the ids of instances.

usage: cryptomatte.py PICTURE.exr STATS.json      (rendered with --aov all --stats STATS.json)
"""
import json, struct, sys
import numpy, OpenImageIO

picture = OpenImageIO.ImageInput.open(sys.argv[1])
spec, pixels = picture.spec(), picture.read_image("float")
channel = {name: pixels[..., k] for k, name in enumerate(spec.channelnames)}

def mattes(layer):
    """The coverage of each name of a layer: a picture for each."""
    facts = {a.name: a.value for a in spec.extra_attribs}
    key = next(k.rsplit("/", 1)[0] for k, v in facts.items() if k.endswith("/name") and v == layer)
    assert facts[key + "/hash"] == "MurmurHash3_32" and facts[key + "/conversion"] == "uint32_to_float32"
    ids = {n: struct.unpack("<f", struct.pack("<I", int(h, 16)))[0] for n, h in json.loads(facts[key + "/manifest"]).items()}
    pairs = [(channel[name], channel[name[:-1] + {"R": "G", "B": "A"}[name[-1]]])
             for name in channel if name.startswith(layer) and name[-1] in "RB"]
    return {name: sum(numpy.where(rank == numpy.float32(i), cover, 0) for rank, cover in pairs) for name, i in ids.items()}

covers = mattes("CryptoInstance")
names = {}
for row in json.load(open(sys.argv[2]))["instance_names"]:
    steps = [name or "node" for name in row["nodes"]] + [row["shape"] or row["kind"]]
    names[row["id"]] = "/".join(f"{step}.{number}" for step, number in zip(steps, row["path"]))
lo = spec.channelnames.index("instance_id.lo")
center = picture.read_image(0, 0, lo, lo + 1, "uint")[..., 0].astype(numpy.int64)
wrong = whole = 0
for number, name in names.items():
    cover = covers.get(name, numpy.zeros(center.shape))
    # A pixel that one instance covers whole shows it in its centre.
    whole += (cover > 0.999).sum()
    wrong += ((cover > 0.999) & (center != number)).sum()
    # And one whose neighbours show nothing else is mostly covered by it.
    inner = numpy.all([numpy.roll(center, (y, x), (0, 1)) == number for y in range(-2, 3) for x in range(-2, 3)], 0)
    wrong += (inner[2:-2, 2:-2] & (cover[2:-2, 2:-2] < 0.5)).sum()
total = sum(mattes("CryptoInstance").values())
print(f"{len(covers)} mattes, {whole} pixels covered whole, {wrong} at odds with ids, most cover {total.max():.6f}")
sys.exit(int(wrong > 0 or whole == 0 or total.max() > 1.0001))
