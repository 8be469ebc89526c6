#!/usr/bin/env python3
"""A picture of a tunnel by MuJoCo, to hold `metrotwin doctor` against: milliseconds an image of 1280 x 720,
read back, of a round tunnel of 30,000 triangles under 8 lights, plain and with painted walls, without
multisampling or shadows. MuJoCo exposes all rows at once, for no time, without noise.

    apt-get install libegl1 libgl1-mesa-dri
    pip install mujoco
    MUJOCO_GL=egl python3 benches/tunnel_by_mujoco.py
"""

import statistics
import time

import mujoco
import numpy

WIDTH, HEIGHT, IMAGES = 1280, 720, 100
AROUND, ALONG, LENGTH_M, RADIUS_M = 60, 250, 160.0, 2.7


def tunnel():
    """Vertices, their places on the painting, and triangles that face inwards."""
    turn = numpy.arange(AROUND) * (2 * numpy.pi / AROUND)
    ring = numpy.stack([0 * turn, RADIUS_M * numpy.cos(turn), RADIUS_M * numpy.sin(turn)], 1)
    rings = [ring + [x, 0, 0] for x in numpy.linspace(0, LENGTH_M, ALONG + 1)]
    faces = []
    for i in range(ALONG):
        for j in range(AROUND):
            a, b = i * AROUND + j, i * AROUND + (j + 1) % AROUND
            faces += [(a, a + AROUND, b), (b, a + AROUND, b + AROUND)]
    places = [[x / 6, j / AROUND] for x in numpy.linspace(0, LENGTH_M, ALONG + 1) for j in range(AROUND)]
    return numpy.concatenate(rings), numpy.array(places), numpy.array(faces)


def scene(material):
    vertices, places, faces = tunnel()
    text = lambda numbers: " ".join(f"{n:g}" for n in numbers.ravel())
    # The scene's headlight is the eighth.
    lights = "".join(
        f'<light pos="{10 + 20 * k} 0 2.2" dir="0 0 -1" castshadow="false"/>' for k in range(7)
    )
    return f"""<mujoco>
      <visual>
        <global offwidth="{WIDTH}" offheight="{HEIGHT}"/>
        <quality offsamples="0" shadowsize="0"/>
        <map zfar="10"/>
      </visual>
      <asset>
        <texture name="painting" type="2d" builtin="checker" mark="random" random="0.3" width="384" height="1024"
          rgb1="0.3 0.3 0.3" rgb2="0.4 0.4 0.4" markrgb="0.2 0.2 0.2"/>
        <material name="plain"/>
        <material name="painted" texture="painting"/>
        <mesh name="tunnel" inertia="shell" vertex="{text(vertices)}" texcoord="{text(places)}"
          face="{text(faces)}"/>
      </asset>
      <worldbody>
        {lights}
        <geom type="mesh" mesh="tunnel" material="{material}"/>
        <camera name="rig" pos="2 1 0" xyaxes="0 -1 0 0 0 1" fovy="45"/>
      </worldbody>
    </mujoco>"""


def image_ms(material):
    """The median of some images."""
    model = mujoco.MjModel.from_xml_string(scene(material))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    taken_ms = []
    with mujoco.Renderer(model, HEIGHT, WIDTH) as renderer:
        for _ in range(IMAGES):
            begin = time.perf_counter()
            renderer.update_scene(data, camera="rig")
            image = renderer.render()
            taken_ms.append(1e3 * (time.perf_counter() - begin))
    assert image.std() > 1, "nothing is drawn"
    return statistics.median(taken_ms)


if __name__ == "__main__":
    for material in ["plain", "painted"]:
        print(f"MuJoCo {mujoco.__version__}, {material}: {image_ms(material):.1f} ms an image (median of {IMAGES})")
