"""Checks a data set that .ci/datasets has rendered.

datasets.py WORK          the data set WORK/all against WORK/task_N.exr
datasets.py WORK AGAIN    pictures of the cameras that were read again against those of WORK/all
"""
import glob
import json
import os
import struct
import sys
import zlib

import numpy as np
import OpenEXR
from PIL import Image
from pycocotools.coco import COCO

work = sys.argv[1]
root = f"{work}/all"


def png(path):
    return np.array(Image.open(path))


def png_deep(path):
    """A picture of three channels of 16 bits, which PIL would cut to 8, of any PNG filter."""
    data, at, rest = open(path, "rb").read(), 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IHDR":
            width, height, depth, color, _, _, interlace = struct.unpack(">IIBBBBB", data[at + 8:at + 21])
        if kind == b"IDAT":
            rest += data[at + 8:at + 8 + length]
        at += length + 12
    assert (depth, color, interlace) == (16, 2, 0)
    raw, stride = np.frombuffer(zlib.decompress(rest), np.uint8).reshape(height, -1), 6
    rows = np.zeros((height + 1, width * 6 + stride), int)
    for y in range(height):
        kind, line, up = raw[y, 0], raw[y, 1:], rows[y]
        row = rows[y + 1]
        for i, value in enumerate(line, stride):
            a, b, c = row[i - stride], up[i], up[i - stride]
            nearest = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))[2]
            row[i] = (value + (0, a, b, (a + b) // 2, nearest)[kind]) % 256
    return rows[1:, stride:].astype(np.uint8).reshape(height, width, 6).view(">u2")


def exr(task):
    channels = OpenEXR.File(f"{work}/task_{task}.exr", separate_channels=True).channels()
    return {name: np.asarray(channel.pixels) for name, channel in channels.items()}


def inverse(rotation, shift):
    return rotation.T, -rotation.T @ shift


if len(sys.argv) > 2:
    again = sorted(glob.glob(f"{sys.argv[2]}/*.png"))
    first = sorted(glob.glob(f"{root}/train_pbr/000000/rgb/*.png"))
    assert len(again) == len(first) > 0, (len(again), len(first))
    # Numbers of a file are written in full, but a pose is inverted, and roundings move silhouettes.
    off = [(np.abs(png(a).astype(int) - png(b)).max(-1) > 1).mean() for a, b in zip(again, first)]
    assert max(off) < 2e-3, off
    print(f"{os.path.basename(sys.argv[2])}: {len(again)} cameras see the same, {max(off):.1e} of pixels aside")
    sys.exit()

# BOP.
chunk = f"{root}/train_pbr/000000"
cameras = json.load(open(f"{chunk}/scene_camera.json"))
truths = json.load(open(f"{chunk}/scene_gt.json"))
infos = json.load(open(f"{chunk}/scene_gt_info.json"))
pictures = sorted(map(int, cameras))
assert pictures == list(range(len(glob.glob(f"{chunk}/rgb/*.png"))))
assert sorted(map(int, truths)) == sorted(map(int, infos)) == pictures
worst, points, masks, hidden, beside, flow, moved, inside = 0.0, 0, 0, 0, 0, 0.0, 0, 0.0
for number in pictures:
    camera, layers = cameras[str(number)], exr(number)
    k = np.array(camera["cam_K"]).reshape(3, 3)
    rotation = np.array(camera["cam_R_w2c"]).reshape(3, 3)
    shift = np.array(camera["cam_t_w2c"]).reshape(3, 1)
    assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    height, width = layers["Z"].shape
    # Depth times its scale is Z within half a step.
    depth = png(f"{chunk}/depth/{number:06}.png")
    assert depth.dtype in (np.uint16, np.int32) and depth.shape == (height, width)
    met = np.isfinite(layers["Z"])
    near = met & (layers["Z"] * 1000 < 65535 * camera["depth_scale"])
    error = np.abs(depth * camera["depth_scale"] - layers["Z"].astype(np.float64) * 1000)[near]
    worst = max(worst, error.max() / camera["depth_scale"])
    assert (depth[~near] == 0).all()
    # K [R|t] p falls in the pixel of p.
    p = np.stack([layers[f"position.{c}"].astype(np.float64)[met] for c in "XYZ"]) * 1000
    q = k @ (rotation @ p + shift)
    y, x = np.nonzero(met)
    away = np.abs(np.stack([q[0] / q[2] - x, q[1] / q[2] - y])).max()
    assert away < 0.5, away
    assert away < 1e-2, away
    points += len(x)
    # Normals towards the camera look at it.
    assert (layers["camera_normal.Z"][met] > -0.75).all()
    # Masks, counts and boxes.
    ids = layers["instance_id.lo"].astype(np.int64)
    note = json.load(open(f"{chunk}/view/{number:06}.json"))
    objects = png(f"{chunk}/objects/{number:06}.png")
    categories = png(f"{chunk}/categories/{number:06}.png")
    assert len(note["objects"]) == len(truths[str(number)]) == len(infos[str(number)])
    for i, (seen, truth, info) in enumerate(zip(note["objects"], truths[str(number)], infos[str(number)])):
        mask = png(f"{chunk}/mask/{number:06}_{i:06}.png")
        visible = png(f"{chunk}/mask_visib/{number:06}_{i:06}.png")
        assert set(np.unique(mask)) <= {0, 255} and mask.dtype == np.uint8
        assert ((visible > 0) == (np.isin(ids, seen["instances"]) & met)).all()
        assert ((visible > 0) == (objects == seen["number"])).all()
        assert (categories[visible > 0] == truth["obj_id"]).all()
        assert (mask[visible > 0] == 255).all()
        assert info["px_count_visib"] == (visible > 0).sum()
        assert info["px_count_valid"] == ((mask > 0) & (depth > 0)).sum()
        assert info["px_count_all"] >= (mask > 0).sum() > -1
        assert info["visib_fract"] == info["px_count_visib"] / info["px_count_all"]
        hidden += int(((mask > 0) & (visible == 0)).sum())
        beside += info["px_count_all"] - int((mask > 0).sum())
        for box, shape in ((info["bbox_visib"], visible), (info["bbox_obj"], mask)):
            rows, columns = np.nonzero(shape)
            if len(rows) == 0:
                assert shape is mask or box == [-1] * 4
                continue
            own = [columns.min(), rows.min(), np.ptp(columns), np.ptp(rows)]
            if shape is visible or info["px_count_all"] == (mask > 0).sum():
                assert box == own, (box, own)
            else:
                assert box[0] <= own[0] and box[1] <= own[1] and box[2] >= own[2] and box[3] >= own[3]
        # The object's own box, by its pose and scale, covers its silhouette.
        pose = np.array(seen["world_from_object"])
        turn, place = np.array(truth["cam_R_m2c"]).reshape(3, 3), np.array(truth["cam_t_m2c"])
        assert np.allclose(rotation @ (pose[:, 3] * 1000) + shift[:, 0], place, atol=1e-6)
        assert np.allclose(turn @ turn.T, np.eye(3), atol=1e-12) and np.linalg.det(turn) > 0
        low, high = np.array(seen["bounds"])
        corners = np.array(np.meshgrid(*zip(low, high))).reshape(3, -1)
        q = k @ (rotation @ ((pose[:, :3] @ corners + pose[:, 3:]) * 1000) + shift)
        if (q[2] > 0).all():
            u, v = q[:2] / q[2]
            x0, y0, w, h = info["bbox_obj"]
            assert x0 >= u.min() - 0.5 and x0 + w <= u.max() + 0.5, (x0, w, u)
            assert y0 >= v.min() - 0.5 and y0 + h <= v.max() + 0.5
        # Coordinates within the box are those of the points.
        within = png_deep(f"{chunk}/coordinates/{number:06}.png")[visible > 0] / 65535 * (high - low) + low
        p = np.stack([layers[f"position.{c}"].astype(np.float64)[visible > 0] for c in "XYZ"], -1)
        away = np.abs(np.linalg.solve(pose[:, :3], (p - pose[:, 3]).T).T - within) / (high - low)
        if len(within):
            inside = max(inside, away.max() * 65535)
        masks += 1
    # Motion against reprojection: the rod goes to its key, all else and the camera stand.
    still = met & (ids != 1)
    for channel in ("forward.u", "forward.v", "backward.u", "backward.v"):
        assert np.abs(layers[channel][still]).max() < 1e-4, channel
    rod = met & (ids == 1)
    turn = np.radians([30, 60])
    key = [np.array([[1, 0, 0, x], [0, np.cos(a), -np.sin(a), 0], [0, np.sin(a), np.cos(a), 0.15], [0, 0, 0, 1]])
           for a, x in zip(turn, (0.1, 0.2))]
    p = np.stack([layers[f"position.{c}"].astype(np.float64)[rod] for c in "XYZ"] + [np.ones(rod.sum())])
    q = k @ (rotation @ (key[1] @ np.linalg.inv(key[0]) @ p)[:3] * 1000 + shift)
    ahead = q[2] > 0
    y, x = np.nonzero(rod)
    off = np.stack([q[0] / q[2] - x - layers["forward.u"][rod], y - q[1] / q[2] - layers["forward.v"][rod]])
    if ahead.any():
        flow = max(flow, np.abs(off[:, ahead]).max())
        moved += int(ahead.sum())
assert moved > 0 and flow < 1e-2, (moved, flow)
assert points >= 10_000, points
assert worst <= 0.5 + 1e-9, worst
assert 0 < inside < 0.6, inside
assert hidden > 0 and beside > 0, (hidden, beside)
print(f"BOP: {len(pictures)} pictures, {masks} masks; depth within {worst:.4f} steps, {points} points in their pixels,"
      f" {hidden} pixels of masks hidden and {beside} beside the picture; flow of {moved} pixels within {flow:.1e}")

# COCO.
coco = COCO(f"{root}/coco.json")
count = 0
for image in coco.loadImgs(coco.getImgIds()):
    number = image["id"]
    assert os.path.exists(f"{root}/{image['file_name']}")
    assert png(f"{root}/{image['file_name']}").shape[:2] == (image["height"], image["width"])
    visible = [i for i, info in enumerate(infos[str(number)]) if info["px_count_visib"] > 0]
    annotations = coco.loadAnns(coco.getAnnIds(imgIds=[number]))
    assert len(annotations) == len(visible)
    for annotation, i in zip(annotations, visible):
        mask = png(f"{chunk}/mask_visib/{number:06}_{i:06}.png") > 0
        assert (coco.annToMask(annotation) == mask).all()
        assert annotation["area"] == mask.sum()
        rows, columns = np.nonzero(mask)
        assert annotation["bbox"] == [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]
        assert annotation["category_id"] == truths[str(number)][i]["obj_id"]
        count += 1
assert {c["name"] for c in coco.loadCats(coco.getCatIds())} == {"bolt", "nut"}
print(f"COCO: pycocotools reads {count} annotations, with the masks of BOP")

# NeRF: the same cameras, with OpenGL's axes.
transforms = json.load(open(f"{root}/transforms.json"))
assert len(transforms["frames"]) == len(pictures)
for number, frame in enumerate(transforms["frames"]):
    pose = np.array(frame["transform_matrix"]) @ np.diag([1, -1, -1, 1])
    rotation, shift = inverse(pose[:3, :3], pose[:3, 3])
    camera = cameras[str(number)]
    assert np.allclose(rotation.ravel(), camera["cam_R_w2c"], atol=1e-12)
    assert np.allclose(shift * 1000, camera["cam_t_w2c"], atol=1e-9)
    k = camera["cam_K"]
    assert [frame["fl_x"], frame["fl_y"], frame["cx"], frame["cy"]] == [k[0], k[4], k[2] + 0.5, k[5] + 0.5]
    assert os.path.exists(f"{root}/{frame['file_path']}") and os.path.exists(f"{root}/{frame['depth_file_path']}")
print(f"NeRF: {len(transforms['frames'])} cameras are those of BOP")

# Kubric: tracks over frames.
tracks = 0
for path in sorted(glob.glob(f"{root}/metadata*.json")):
    data = json.load(open(path))
    frames = data["metadata"]["num_frames"]
    assert len(data["camera"]["positions"]) == len(data["camera"]["quaternions"]) == frames
    k = np.array(data["camera"]["K"])
    for instance in data["instances"]:
        for at, frame in enumerate(instance["frames"]):
            w, x, y, z = data["camera"]["quaternions"][frame]
            turn = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                             [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                             [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
            p = turn.T @ (np.array(instance["positions"][at]) - data["camera"]["positions"][frame])
            q = k @ p
            assert np.allclose(q[:2] / q[2], instance["image_positions"][at], atol=1e-9), (q, instance)
            box = np.array(instance["bboxes_3d"][at])
            assert box.shape == (8, 3)
        tracks += 1
print(f"Kubric: {tracks} tracks are where their cameras see them")
