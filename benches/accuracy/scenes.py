"""The scenes that `docs/accuracy.md` is made of."""

# What accuracy costs: the paper's five scenes and the robot arm (the first six), and five hard ones.
STUDIES = {
    "bend45": "decks/bend45.toml",
    "rollup": "decks/rollup.toml",
    "helix": "decks/helix.toml",
    "top_beam": "decks/top_beam.toml",
    "right_angle": "decks/right_angle.toml",
    "robot_arm": "decks/robot_arm.toml",
    "elastica_176": "decks/hard/s10_elastica_176_degrees.toml",
    "hockling_rod": "decks/hard/s07_hockling_rod.toml",
    "flying_2d": "decks/hard/d06_flying_2d.toml",
    "stiff_pendulum": "decks/hard/d08_stiff_pendulum.toml",
    "blade_100_turns": "decks/hard/d05_blade_100_turns.toml",
}

# Where a wanted accuracy and error bars are held against finer runs: statics, motions, modes; whole beams, joints, bodies.
KNOWN = [
    "decks/bend45.toml",
    "decks/rollup.toml",
    "decks/helix.toml",
    "decks/top_rigid.toml",
    "decks/top_beam.toml",
    "decks/robot_arm.toml",
    "decks/right_angle.toml",
    "decks/spin_up.toml",
    "decks/minimal/arc.toml",
    "decks/minimal/taper.toml",
    "decks/minimal/twist.toml",
    "decks/minimal/load_force.toml",
    "decks/minimal/load_moment.toml",
    "decks/minimal/line_load.toml",
    "decks/minimal/line_load_follower.toml",
    "decks/minimal/load_section.toml",
    "decks/minimal/polyline.toml",
    "decks/minimal/frame.toml",
    "decks/minimal/spring.toml",
    "decks/minimal/free_strain.toml",
    "decks/minimal/generalized_alpha.toml",
    "decks/minimal/hht.toml",
    "decks/minimal/damping.toml",
    "decks/minimal/initial_spin_beam.toml",
    "decks/minimal/point_mass.toml",
    "decks/minimal/stage_static_dynamic.toml",
    "decks/minimal/joint_universal.toml",
    "decks/minimal/motion_rotate.toml",
    "decks/modes/cantilever_modes.toml",
    "decks/paths/ltb_midspan.toml",
    "decks/hard/s10_elastica_176_degrees.toml",
    "decks/hard/s12_cantilevers_dead_force.toml",
    "decks/hard/r03_half_circle_skew.toml",
    "decks/hard/d06_flying_2d.toml",
    "decks/hard/d08_stiff_pendulum.toml",
    "decks/hard/d10_spin_up_50_turns.toml",
]

TARGETS = [1e-2, 1e-4, 1e-6]
# Seconds on the wall that a search may take.
BUDGET = 60
