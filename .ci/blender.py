"""Says what Blender makes of a picture of all layers; needs the Python package bpy.

usage: blender.py PICTURE.exr
"""
import sys
import bpy

image = bpy.data.images.load(sys.argv[1])
len(image.pixels)  # Reads the file.
tree = bpy.data.node_groups.new("layers", "CompositorNodeTree")
node = tree.nodes.new("CompositorNodeImage")
node.image = image
passes = [output.name for output in node.outputs if output.enabled]
assert image.type == "MULTILAYER", image.type
for name in ["Combined", "Alpha", "Depth", "normal", "diffuse_direct", "specular_indirect", "environment", "variance"]:
    assert name in passes, (name, passes)
matte = tree.nodes.new("CompositorNodeCryptomatteV2")
matte.source, matte.image = "IMAGE", image
for name in ["CryptoObject", "CryptoMaterial", "CryptoInstance"]:
    matte.layer_name = name
print(f"Blender {bpy.app.version_string}: {len(passes)} passes, all right")
