"""Names of tables that several stages share: what identify observed, and what the campaign's page draws."""

OBSERVED: tuple[str, ...] = (
    *("orders", "spindle", "force_refused", "yielding"),
    *("joint_torque", "tool_force", "joint_force_refused", "joint_friction", "joint_friction_curve"),
    *("waviness_points", "waviness_runs", "waviness_refused"),
    *("tip_force", "profile_points", "observability", "arm_loads", "deformation_refused"),
    *(
        "face_indices",
        "face_map",
        "face_contacts",
        "face_placed",
        "face_points",
        "face_beside",
        "face_loads",
        "face_mass",
        "face_refused",
    ),
    "face_planned",
    *("modes", "lobes", "frf_used", "stabilisation", "lobe_runs", "lobes_refused"),
    *("mode_shapes", "mode_mac", "lobe_methods", "lobe_islands", "lobe_stations"),
    *("chatter_runs", "chatter_records"),
    *("published_errors", "published_modes", "published_loads", "published_matrices"),
    "published_forces",
)

# What the plots of the campaign's page are drawn from
PAGE: tuple[str, ...] = ("comparison", "lobes", "lobes_final", "lobe_islands", "frf_used", "face_map")
