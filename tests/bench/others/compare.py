#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Motion blur beside POV-Ray's and Cycles': make bench-others.

Two scenes (head.st4, propeller.st4): the same triangles, one sun, direct light, a box filter of a
pixel, flat shading. POV-Ray has no motion blur: n sharp subframes are averaged, each with one ray a
pixel, at a place of its own within it. Its meshes and those of Cycles are written by `st4 mesh`.
Errors are root mean squares in parts of the mean brightness, against st4 with many samples; seconds
are those of the processor (user and system, all threads): st4's for the whole program, POV-Ray's
likewise, summed over subframes, Cycles' for the call that renders, without Blender's start.

st4=PROGRAM target=0.03 scenes="head propeller" reference=1024; what is not installed is left out.
"""
import math, os, re, shutil, struct, subprocess, sys, tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ST4 = os.path.abspath(os.environ.get("ST4", "./st4"))
TARGET = float(os.environ.get("target") or "0.03")
REFERENCE = int(os.environ.get("reference") or "1024")
SCENES = (os.environ.get("scenes") or "head propeller").split()
FPS = 24


def run(command, **more):
    """Seconds of the processor; stops where the command fails."""
    before = os.times()
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **more)
    after = os.times()
    if done.returncode:
        sys.exit("%s:\n%s" % (" ".join(command), done.stdout.decode(errors="replace")[-2000:]))
    seconds = after.children_user - before.children_user + after.children_system - before.children_system
    return seconds, done.stdout.decode(errors="replace")


class Scene:
    def __init__(self, name, work):
        self.name, self.work = name, work
        self.path = os.path.join(HERE, name + ".st4")
        text = open(self.path).read()
        self.width, self.height = map(int, re.search(r"size = <(\d+), (\d+)>", text).groups())
        self.moving = "Turning" if "Turning" in text else None
        self.colors = re.findall(r"matte\(<(.*?)>\)", text)

    def file(self, name):
        return os.path.join(self.work, self.name + name)

    def mesh(self, frames, label, name):
        """Writes the triangles as they are so many frame periods after the first frame's start."""
        path = self.file(name)
        command = [ST4, "mesh", self.path, "--at", "%.9gf" % frames, "-q", "-o", path]
        run(command + (["--label", label] if label else []))
        return path


def read_ply(path):
    data = open(path, "rb").read()
    head, body = data.split(b"end_header\n", 1)
    n = int(re.search(rb"element vertex (\d+)", head).group(1))
    m = int(re.search(rb"element face (\d+)", head).group(1))
    columns = re.findall(rb"property (double|float) (\w+)", head)
    size = sum(8 if kind == b"double" else 4 for kind, _ in columns)
    form = "<" + "".join("d" if kind == b"double" else "f" for kind, _ in columns)
    points = [struct.unpack_from(form, body, i * size)[:3] for i in range(n)]
    faces = [struct.unpack_from("<3i", body, n * size + 13 * i + 1) for i in range(m)]
    return points, faces


# ---- The three renderers: seconds, and the picture in *path


def render_st4(scene, n, path, seed=0):
    return run([ST4, "render", scene.path, "-s", str(n), "--seed", str(seed), "--threads", "1", "-q", "-o", path])[0]


def mesh2(points, faces, color):
    # Left-handed: z is negated.
    lines = ["mesh2 { vertex_vectors { %d," % len(points)]
    lines += ["<%.9g,%.9g,%.9g>," % (p[0], p[1], -p[2]) for p in points]
    lines += ["} face_indices { %d," % len(faces)]
    lines += ["<%d,%d,%d>," % f for f in faces]
    lines += ["} pigment { rgb <%s> } finish { ambient 0 diffuse 1 } }" % color]
    return "\n".join(lines)


def halton(i, base):
    value, part = 0.0, 1.0
    while i:
        part /= base
        value += part * (i % base)
        i //= base
    return value


def render_povray(scene, n, path):
    aspect, seconds, pictures = scene.width / scene.height, 0, []
    still = ""
    if scene.moving:
        still = mesh2(*read_ply(scene.mesh(0, "Wall", ".still.ply")), scene.colors[-1])
    for k in range(n):
        points, faces = read_ply(scene.mesh((k + 0.5) / n, scene.moving, ".moving.ply"))
        dx = (halton(k + 1, 2) - 0.5) * aspect / scene.width
        dy = (halton(k + 1, 3) - 0.5) / scene.height
        with open(scene.file(".pov"), "w") as pov:
            pov.write("""#version 3.7; global_settings { assumed_gamma 1 }
                camera { location <0, 0, -5> direction <%.12g, %.12g, %.12g> right x*%.12g up y }
                light_source { <1, 1.2, -1.5>*1e5 rgb %.12g parallel point_at 0 }
                background { rgb 0 }\n""" % (dx, dy, 0.5 / math.tan(math.radians(18)), aspect, 3 / math.pi))
            pov.write(still + mesh2(points, faces, scene.colors[0]))
        pictures.append(scene.file(".%d.exr" % k))
        seconds += run(["povray", "+I" + scene.file(".pov"), "+O" + pictures[-1], "+FE", "-D", "-A", "+WT1",
                        "+W%d" % scene.width, "+H%d" % scene.height])[0]
    sums = [pictures[0]]
    for picture in pictures[1:]:
        sums += [picture, "--add"]
    run(["oiiotool"] + sums + ["--ch", "R,G,B", "--divc", str(n), "-d", "float", "-o", path])
    return seconds


def point_cache(scene, path):
    """64 spans in a frame, straight between them as st4's own, and two behind it."""
    with open(path, "wb") as out:
        for k in range(67):
            points, _ = read_ply(scene.mesh(k / 64, scene.moving, ".key.ply"))
            if k == 0:
                out.write(struct.pack("<12siiffi", b"POINTCACHE2\0", 1, len(points), 1, 1 / 64, 67))
            out.write(b"".join(struct.pack("<3f", *p) for p in points))


def render_cycles(scene, n, path, seed=0):
    blender = ["blender", "-b", "--factory-startup", "-noaudio", "-t", "1", "-P", os.path.join(HERE, "cycles.py"), "--"]
    first = scene.file(".first.ply")
    if not os.path.exists(first):
        scene.mesh(0, scene.moving, ".first.ply")
        point_cache(scene, scene.file(".pc2"))
        if scene.moving:
            scene.mesh(0, "Wall", ".still.ply")
    _, text = run(blender + [first, scene.file(".still.ply") if scene.moving else "", scene.file(".pc2"),
                             "120" if scene.moving else "0", str(scene.width), str(scene.height),
                             ";".join(scene.colors), str(n), str(seed), path])
    return float(re.search(r"seconds: ([0-9.]+)", text).group(1))


# ---- Errors


def error(picture, reference):
    _, text = run([ST4, "compare", picture, reference, "--metric", "relrmse"])
    return float(re.search(r"^relrmse +(\S+)", text, re.M).group(1))


def reach(points):
    """Seconds to the target, between or beyond measured points by their slope in logarithms."""
    for (t0, e0), (t1, e1) in zip(points, points[1:]):
        if e1 <= TARGET or (t1, e1) == points[-1]:
            if e1 > 0.9 * e0:
                break
            return t0 * (TARGET / e0) ** (math.log(t1 / t0) / math.log(e1 / e0))
    return points[0][0] if points[0][1] <= TARGET else math.inf  # it does not come nearer


def ladder(name, render, counts, scene, reference):
    points = []
    for n in counts:
        path = scene.file(".%s.exr" % name)
        seconds = render(scene, n, path)
        points.append((max(seconds, 1e-3), error(path, reference)))
        print("  %-8s %5d samples  %8.2f s  error %.4f" % (name, n, *points[-1]), flush=True)
        if points[-1][1] <= TARGET:
            break
    seconds = reach(points) if len(points) > 1 else points[0][0]
    print("  %-8s %.3g s to an error of %g" % (name, seconds, TARGET), flush=True)
    return seconds


def main():
    work = tempfile.mkdtemp(prefix="bench-others.")
    try:
        for name in SCENES:
            scene = Scene(name, work)
            print(name, flush=True)
            reference = scene.file(".reference.exr")
            render_st4(scene, REFERENCE, reference, 99)
            st4 = ladder("st4", render_st4, [4, 16, 64, 256, 1024], scene, reference)
            if shutil.which("povray") and shutil.which("oiiotool"):
                other = ladder("povray", render_povray, [4, 16, 64, 256], scene, reference)
                print("  POV-Ray / st4: %.1f" % (other / st4))
            if shutil.which("blender"):
                a, b = scene.file(".a.exr"), scene.file(".b.exr")
                render_cycles(scene, 256, a, 1)
                render_cycles(scene, 256, b, 2)
                print("  pictures differ by %.4f; two of Cycles' own, of 256 samples, by %.4f" %
                      (error(a, reference), error(a, b)), flush=True)
                other = ladder("cycles", render_cycles, [4, 16, 64, 256, 1024], scene, reference)
                print("  Cycles / st4: %.1f" % (other / st4))
    finally:
        shutil.rmtree(work)


main()
