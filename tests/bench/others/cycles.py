# SPDX-License-Identifier: Apache-2.0
"""A scene for Cycles, run inside Blender by compare.py: meshes, one sun, motion blur over a frame."""
import math, os, re, struct, sys

import bpy
import mathutils

moving, still, cache, turn, width, height, colors, samples, seed, out = sys.argv[sys.argv.index("--") + 1:]


def read_ply(path):
    data = open(path, "rb").read()
    head, body = data.split(b"end_header\n", 1)
    n = int(re.search(rb"element vertex (\d+)", head).group(1))
    m = int(re.search(rb"element face (\d+)", head).group(1))
    kinds = ["d" if kind == b"double" else "f" for kind in re.findall(rb"property (double|float) \w+", head)]
    form, size = "<" + "".join(kinds), sum(8 if k == "d" else 4 for k in kinds)
    points = [struct.unpack_from(form, body, i * size)[:3] for i in range(n)]
    return points, [struct.unpack_from("<3i", body, n * size + 13 * i + 1) for i in range(m)]


def add(path, color):
    mesh = bpy.data.meshes.new("mesh")
    points, faces = read_ply(path)
    mesh.from_pydata(points, [], faces)
    material = bpy.data.materials.new("matte")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    diffuse, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (*map(float, color.split(",")), 1)
    material.node_tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    mesh.materials.append(material)
    thing = bpy.data.objects.new("thing", mesh)
    bpy.context.collection.objects.link(thing)
    return thing


bpy.ops.object.select_all(action="SELECT")
bpy.ops.object.delete()
colors = colors.split(";")
thing = add(moving, colors[0])
if still:
    add(still, colors[-1])
thing.cycles.use_motion_blur = True
if turn != "0":  # degrees in a frame, about z
    for frame, angle in ((1, 0), (3, 2 * math.radians(float(turn)))):
        thing.rotation_euler = (0, 0, angle)
        thing.keyframe_insert("rotation_euler", frame=frame)
    for curve in thing.animation_data.action.fcurves:
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    thing.cycles.motion_steps = 5
else:
    modifier = thing.modifiers.new("cache", "MESH_CACHE")
    modifier.cache_format, modifier.filepath = "PC2", cache
    modifier.interpolation, modifier.time_mode, modifier.play_mode = "LINEAR", "FRAME", "SCENE"
    # Sample 64 * frame - 64; Blender takes no scale above 100.
    modifier.frame_scale, modifier.frame_start = 64, 64
    thing.cycles.use_deform_motion = True
    thing.cycles.motion_steps = 7

light = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
light.data.energy, light.data.angle = 3, 0

light.rotation_euler = mathutils.Vector((1, 1.2, 1.5)).to_track_quat("Z", "Y").to_euler()
bpy.context.collection.objects.link(light)

camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
camera.location = (0, 0, 5)
camera.data.sensor_fit, camera.data.angle = "VERTICAL", math.radians(36)
bpy.context.collection.objects.link(camera)

scene = bpy.context.scene
scene.camera, scene.render.engine = camera, "CYCLES"
world = bpy.data.worlds.new("black")
world.use_nodes = True
world.node_tree.nodes["Background"].inputs["Color"].default_value = (0, 0, 0, 1)
scene.world = world
scene.render.resolution_x, scene.render.resolution_y = int(width), int(height)
scene.render.resolution_percentage = 100
scene.render.use_motion_blur = True
# Cycles drops the last 0.8 % of the shutter's time.
scene.render.motion_blur_shutter = 1.007874
scene.cycles.motion_blur_position = "START"
scene.cycles.samples, scene.cycles.seed = int(samples), int(seed)
scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1
scene.cycles.max_bounces = 0
scene.cycles.sample_clamp_direct = 0
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_depth = "32"
scene.render.filepath = out
scene.frame_set(1)
before = os.times()
bpy.ops.render.render(write_still=True)
after = os.times()
print("seconds: %.4f" % (after.user - before.user + after.system - before.system))
