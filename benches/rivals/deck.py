"""The decks of the scenes for beamsim."""

import scenes

FRAME = """\
[section.s]
EA = {EA!r}
GA = {GA!r}
GJ = {GJ!r}
EI = {EI!r}
rhoA = {rhoA!r}
rhoJ = {rhoJ!r}

[[beam]]
name = "b"
section = "s"
{course}
elements = {elements}
order = {order}
interpolation = "{interpolation}"

[[stage]]
{stage}

[output]
nodes = {nodes}
columns = {columns}

[effects]
planar = {planar}

{scene}"""

CANTILEVER = """\
[point]
root = [0, 0, 0]
tip = [{length!r}, 0, 0]

[[support]]
at = "root"
fix = "all"

"""

ROLL_UP = CANTILEVER + """\
[[load]]
at = "tip"
moment = [0, 0, {moment!r}]
"""

BEND = """\
[point]
root = [0, 0, 0]
middle = {middle!r}
tip = {tip!r}

[[support]]
at = "root"
fix = "all"

[[load]]
at = "tip"
force = [0, 0, {force!r}]
"""

RIGHT_ANGLE = """\
[point]
root = [0, 0, 0]
elbow = [{length!r}, 0, 0]
tip = [{length!r}, {length!r}, 0]

[[support]]
at = "root"
fix = "all"

[[load]]
at = "elbow"
force = [0, 0, 50]
history = "hat"

[history.hat]
times = [0, 1, 2]
values = [0, 1, 0]
"""

FLYING = """\
[point]
start = {start!r}
end = {end!r}

[[load]]
at = "start"
force = [20, 0, 0]
moment = [0, -100, -200]
history = "hat"

[history.hat]
times = [0, 2.5, 5]
values = [0, 1, 0]
"""


FLOOR = CANTILEVER + """\
[[load]]
along = "b"
force = [0, 0, {weight!r}]

[[surface]]
name = "floor"
kind = "plane"
point = [0, 0, {height!r}]
normal = [0, 0, 1]

[[contact]]
name = "rest"
beams = ["b"]
surfaces = ["floor"]
radius = {radius!r}
penetration = 1e-6
"""


def scene_text(scene):
    """Points, supports and loads of a scene, and the course of its beam."""
    if scene in scenes.CIRCLES:
        text = ROLL_UP.format(length=scenes.LENGTH, moment=scenes.roll_up_moment(scene))
        return text, 'through = ["root", "tip"]'
    if scene == "S2":
        _, middle, tip = map(list, scenes.nodes("S2", 2))
        return BEND.format(middle=middle, tip=tip, force=scenes.BEND_FORCE), 'arc = ["root", "middle", "tip"]'
    if scene == "S3":
        return RIGHT_ANGLE.format(length=scenes.LENGTH), 'through = ["root", "elbow", "tip"]'
    if scene == "S6":
        text = FLOOR.format(length=scenes.LENGTH, weight=-scenes.FLOOR_WEIGHT, radius=scenes.FLOOR_RADIUS,
                            height=-scenes.FLOOR_GAP - scenes.FLOOR_RADIUS)
        return text, 'through = ["root", "tip"]'
    start, end = list(scenes.FLYING_START), list(scenes.FLYING_END)
    return FLYING.format(start=start, end=end), 'through = ["start", "end"]'


def deck(job):
    """The deck of a job: scene, elements, levels or step; order, interpolation, planar, tolerance where given."""
    scene, elements = job["scene"], job["elements"]
    text, course = scene_text(scene)
    if "step" in job:
        stage = f'kind = "dynamic"\nend = {scenes.END_TIME[scene]!r}\nstep = {job["step"]!r}'
    else:
        stage = f'kind = "static"\nsteps = {job["levels"]}'
    if "tolerance" in job:
        stage += f"\ntolerance = {job['tolerance']!r}"
    outputs = {"S2": ["tip"], "S3": ["elbow", "tip"], "S5": ["start", "end"]}.get(scene, ["b@0.5", "tip"])
    columns = '["u"]' if scene == "S3" else '["x"]'
    if scene == "S5":
        columns += "\nevery = 1000000"
    section = dict(scenes.SECTIONS[scene], rhoJ=list(scenes.SECTIONS[scene]["rhoJ"]))
    return FRAME.format(
        **section, course=course, stage=stage, scene=text, columns=columns,
        nodes=str(outputs).replace("'", '"'), elements=elements // 2 if scene == "S3" else elements,
        order=job.get("order", 1), interpolation=job.get("interpolation", "relative"),
        planar=str(job.get("planar", False)).lower())
